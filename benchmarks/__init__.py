"""Figures, measured: `python -m benchmarks`."""
