"""Identification of a loop from its record: frequency responses with intervals, margins, nonlinearity."""
