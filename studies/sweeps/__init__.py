"""Sensitivity and robustness sweeps: designs in chunks, on one machine or many, gated by a committed baseline.

- `spec`, `sweep`: a sweep as a TOML file or built in Python; `subject`: the observer that is swept
- `designs`, `skip_ahead`: which parameter values, row by row without the rows before; `measures*`: what is computed of them
- `evaluate`: one chunk; `engine`, `executors`, `cluster`: all chunks; `store`: the folder they land in
- `summary`, `quantiles`, `variance`: the figures of a finished sweep; `gate`, `attribution`, `baseline`, `reports`: the verdict
"""
