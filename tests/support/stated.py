"""Sizes of type B for tests of sensitivities.

A stated error is in the covariance of the data and moves the weights of the fit, so a budget has the sensitivities of
these weights.  Stated at FAINT of its size it moves none: the lines, over FAINT, are what the error does to a run in
which nothing is stated.
"""

FAINT = 1e-9
