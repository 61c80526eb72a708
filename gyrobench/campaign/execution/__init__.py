"""Execution of a campaign: definition, plan, workers, store of the results."""
