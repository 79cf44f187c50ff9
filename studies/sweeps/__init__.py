"""Sensitivity and robustness sweeps: designs in chunks, on one machine or many, gated by a committed baseline.

- `spec`, `sweep`: a sweep as a TOML file, or built in Python; `observer`, `plant`: the observer that is swept
- `ranges`: how far each parameter goes; the designs in that box are those of `analysis.sensitivity`
- `measures`: what a measure is; with `measures_costly`, `measures_drive`: those that a file can name
- `drive_replay`: drives from logs or truth vehicles, replayed by the observers of many designs at once
- `evaluate`, `tables`: one chunk and its bytes; `engine`: all chunks (`studies.execution`); `store`: their folder
- `store.Rows`, `summary`: the numbers of a finished sweep, in memory that does not grow with it
- `baseline`, `gate`, `reports`: the verdict, and who did it; `plots`: the pictures
"""
