"""From a request to a result: runs, measured data, suites and comparisons, as the commands and the library do them."""
