"""How numbers of a model move with its parameters: designs in a box, one at a time, Sobol indices, quantiles, the worst case."""

from analysis.sensitivity.box import Box, around
from analysis.sensitivity.designs import Corners, FullGrid, LatinHypercube, OneAtATimeDesign, Saltelli, Sobol
from analysis.sensitivity.indices import SobolIndices, variance_indices
from analysis.sensitivity.measure import OneAtATime, evaluate, one_at_a_time, one_by_one, sample, sample_grid
from analysis.sensitivity.worst import WorstCase, worst_case

__all__ = [
    "Box", "Corners", "FullGrid", "LatinHypercube", "OneAtATime", "OneAtATimeDesign", "Saltelli", "Sobol", "SobolIndices",
    "WorstCase", "around", "evaluate", "one_at_a_time", "one_by_one", "sample", "sample_grid", "variance_indices", "worst_case",
]  # fmt: skip
