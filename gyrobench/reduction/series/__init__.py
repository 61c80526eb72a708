"""Statistics of evenly sampled series: deviations, noise coefficients, models of random drift; plain arrays, SI."""
