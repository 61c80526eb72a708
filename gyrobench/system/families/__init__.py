"""Families of systems: what the systems of one kind of test share."""
