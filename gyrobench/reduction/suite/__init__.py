"""Several tests of one instrument: equal quantities, consistency."""
