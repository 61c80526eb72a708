"""Windows of a record of turn-ons, with the turn-on and the day of each; names of what a fit finds of them."""

from __future__ import annotations

import numpy as np

from gyrobench.arrays import Array
from gyrobench.record.record import Record


def labelled(record: Record) -> dict[str, Array]:
    """Return the windows with turn_on, day and rate; of a run by its plan."""
    windows = dict(record.windows)
    if not record.run.measured:
        rows = {row.phase: row for row in record.run.plan}
        phase = np.asarray(windows["phase"]).astype(int).tolist()
        windows["turn_on"] = np.array(phase)
        windows["day"] = np.array([round(rows[p].target_y) for p in phase])
        if record.run.options["rate"]:
            windows["rate"] = np.array([rows[p].target for p in phase])
    return windows


def unknowns(group: str, columns: int, warming: int, scaling: int) -> list[str]:
    """Return the names of the unknowns of the fit: biases, sizes and time constants of the exponentials."""
    each = [("warm-up", k + 1) for k in range(warming)] + [("scale factor", k + 1) for k in range(scaling)]
    names = [f"bias of {group} {k + 1}" for k in range(columns)]
    return names + [f"{what} of {n} {k}" for what in ("size", "time constant") for n, k in each]
