"""The study `fault-matrix`: every signal of the pipeline at fault in every way, on five drives."""
