"""First times at which parts of a run reached limits, from its record: what led to a failure, before what ended it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

MAX_LISTED = 4


def limit_flags(names: list[str], sockets: Mapping[str, Any]) -> dict[str, str]:
    """Return the recorded channels that say that a limit is reached, and what each means; sockets: slot -> Socket."""
    found = {}
    for name in names:
        slot, _, variable = name.partition(".")
        connector = sockets[slot].connector(variable) if slot in sockets else None
        if connector is not None and connector.limit:
            found[name] = connector.meaning.removeprefix("1 while ")
    return found


def limits_reached(channels: Mapping[str, Any], flags: Mapping[str, str]) -> str:
    """Return a sentence on the limits that were reached, the first one first; "" where none was."""
    first = {}
    for name in flags:
        active = np.asarray(channels[name]) > 0.5
        if active.any():
            first[name] = float(channels["time"][int(np.argmax(active))])
    if not first:
        return ""
    reached = sorted(first, key=lambda name: first[name])
    text = "; then ".join(f"{name} at t = {first[name]:.6g} s ({flags[name]})" for name in reached[:MAX_LISTED])
    more = len(reached) - MAX_LISTED
    return f"limits reached before that, first: {text}" + (f"; and {more} more" if more > 0 else "")
