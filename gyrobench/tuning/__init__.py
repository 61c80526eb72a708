"""Tuning of a stabilizer loop: wishes, spread of the parts, structures, search, proof in co-simulation."""
