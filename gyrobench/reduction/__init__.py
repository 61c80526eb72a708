"""Reductions: from a record to a result with uncertainties."""
