"""Runs: the numeric program of a system, the reference and the native engine, supervision, checkpoints."""
