"""Robots: kinematics, limits and geometry."""
