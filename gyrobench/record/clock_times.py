"""Dates and clock times of laboratory files, and readings that last to the next row."""

from __future__ import annotations

import math
import re
import statistics
from collections.abc import Mapping
from datetime import datetime

from gyrobench.record.csv_reader import row_list

HALF_DAY = 43200.0  # s
LONG = 5.0  # medians; a reading of ten minutes with an hour of summer time is seven
SET_BACK = ": a clock that was set back? Times in UTC or with their zone are needed"
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


def length_between(start: str, end: str) -> float:
    """Return how long a reading lasts, in the unit of its times; NaN where one is no number, which the reader names."""
    try:
        return float(end) - float(start)
    except ValueError:
        return math.nan


def long_readings(lengths: Mapping[int, float]) -> list[str]:
    """Return the note on readings, row -> length, that are far longer than most."""
    limit = LONG * statistics.median(lengths.values()) if lengths else 0.0
    if not (rows := [row for row, length in lengths.items() if length > limit]):
        return []
    return [
        f"Readings that last to the next row, more than {LONG:g} times as long as the median of all: {row_list(rows)}. "
        "A pause is in them, or a clock that was set (summer time). Give the ends of the readings in the column map, "
        "or leave these rows out."
    ]
