"""General filters over any batch: Kalman, extended, unscented; and whether their covariances tell the truth."""

from estimators.filters.chi_square import chi_square_probability, chi_square_quantile
from estimators.filters.consistency import Consistency, average_band, consistency, nees, nis
from estimators.filters.extended import ExtendedKalmanFilter
from estimators.filters.gaussian import GaussianFilter
from estimators.filters.kalman import KalmanFilter
from estimators.filters.sigma import SigmaWeights
from estimators.filters.step import FilterStep
from estimators.filters.unscented import UnscentedKalmanFilter

__all__ = [
    "Consistency",
    "ExtendedKalmanFilter",
    "FilterStep",
    "GaussianFilter",
    "KalmanFilter",
    "SigmaWeights",
    "UnscentedKalmanFilter",
    "average_band",
    "chi_square_probability",
    "chi_square_quantile",
    "consistency",
    "nees",
    "nis",
]
