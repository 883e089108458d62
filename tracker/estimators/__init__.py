"""Estimators of the person's bearing and distance: the paper's filters and those that are compared with them."""

from tracker.estimators.akf import AdaptiveKalmanFilter
from tracker.estimators.akf_cv import AugmentedKalmanFilter
from tracker.estimators.base import Estimate, Estimator
from tracker.estimators.kf import KalmanFilter
from tracker.estimators.none import NoFilter
from tracker.estimators.two_axis import LOCK_OUT_WINDOW, LockOutWarning, chi2_quantile

__all__ = [
    "LOCK_OUT_WINDOW",
    "AdaptiveKalmanFilter",
    "AugmentedKalmanFilter",
    "Estimate",
    "Estimator",
    "KalmanFilter",
    "LockOutWarning",
    "NoFilter",
    "chi2_quantile",
]
