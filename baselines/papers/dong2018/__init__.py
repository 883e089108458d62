"""Dong et al.: adaptive Kalman filter for a human-following robot (Table 1, figures 6 to 9)."""
