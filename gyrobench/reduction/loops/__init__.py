"""Measures of loops and estimators."""
