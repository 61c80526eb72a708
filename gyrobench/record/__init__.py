"""Records: of runs, of laboratories, of recorded motions."""
