"""Reproductions of published results: clients of the benchmark."""
