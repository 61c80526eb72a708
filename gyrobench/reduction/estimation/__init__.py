"""Estimation: regression, noise models, uncertainties, intervals."""
