"""The software renderer: compiled kernels over tiles."""
