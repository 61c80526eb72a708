"""The base class of all errors meant for people."""

from __future__ import annotations


class GyrobenchError(Exception):
    """An error whose text says what is wrong and what to do; a command shows the text and no traceback."""

    exit_code = 2  # of the command that ends with it
