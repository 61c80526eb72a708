"""Reductions of drift tests: regressors, harmonics, composite drift."""
