"""The base class of all errors meant for people."""

from __future__ import annotations

#: what messages advise a person at a shell to do; a face that has a button for it names the button
RESUMING = "the same command with --resume"
REDUCING = " (gyrobench report reduces it, or lists what is missing)"


class GyrobenchError(Exception):
    """An error whose text says what is wrong and what to do; a command shows the text and no traceback."""

    exit_code = 2  # of the command that ends with it
