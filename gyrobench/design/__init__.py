"""Designs of tests: which positions, how long, in which order, for a wanted uncertainty."""
