"""Analysis of evenly sampled series: deviations, noise coefficients, models; arrays (SI), no record, no report."""
