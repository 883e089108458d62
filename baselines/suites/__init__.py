"""Suites of the benchmark: one file each."""
