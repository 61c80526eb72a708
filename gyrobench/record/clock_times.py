"""Dates and clock times of laboratory files."""

from __future__ import annotations

import re
from datetime import datetime

HALF_DAY = 43200.0  # s
DATED = re.compile(r"%[djyYxcmbB]")
LONG_FRACTION = re.compile(r"([.,]\d{6})\d+")


def moment(text: str, form: str) -> datetime:
    """Return the moment of a text; its fraction of a second may be left out, or longer than microseconds.

    Raises ValueError for a text of another form.
    """
    try:
        return datetime.strptime(text, form)
    except ValueError:
        if "%f" not in form:
            raise
        short = LONG_FRACTION.sub(r"\1", text)
        return datetime.strptime(short, form if short != text else re.sub("[.,]%f", "", form))
