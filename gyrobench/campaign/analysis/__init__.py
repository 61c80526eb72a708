"""Analysis of a stored campaign: distributions, coverage, effects of the axes, lots, comparison of two campaigns."""
