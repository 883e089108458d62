"""Estimators of the person's bearing and distance."""
