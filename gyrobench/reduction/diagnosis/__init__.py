"""Whether a result can be believed: handling errors, plausibility, the simulated truth."""
