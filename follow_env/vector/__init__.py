"""The kinematic engine of `FollowVectorEnv`: worlds as records, compiled by numba."""
