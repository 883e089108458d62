"""Learned followers: how they are trained, and the small agents that are shipped."""
