"""Compiled episodes of many worlds at once, and their pictures."""
