"""Systems of FMUs: sockets, wiring, order, engines, record, run, SSP."""
