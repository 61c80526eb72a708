"""Status of a run and its last rows, in memory that a second process may look at.

A process that crashes leaves it as it was, so that what was recorded until then is not lost.
"""

from __future__ import annotations

import ctypes
import mmap
from collections.abc import Callable
from pathlib import Path

import numpy as np

from gyrobench.arrays import Array
from gyrobench.engine.program import TYPES, Program

BLOCK = 4096  # rows
#: calls of an FMU by number; engine.c knows those that set or get values, by the code of their type, and doStep
CALLS = (
    "",
    *(f"set{t.call}" for t in TYPES),
    "doStep",
    *(f"get{t.call}" for t in TYPES),
    "loading",
    "instantiate",
    "setDebugLogging",
    "setString",
    "setupExperiment",
    "enterInitializationMode",
    "exitInitializationMode",
    "serializeFMUstate",
    "deSerializeFMUstate",
    "terminate",
    "freeInstance",
)
SET, STEP, GET = 1, 1 + len(TYPES), 2 + len(TYPES)


class Status(ctypes.Structure):
    """Progress of a run; engine.c has the first five fields.

    k: steps done, -1 before the first one can begin.  channel_rows, window_rows: in the blocks.  part: number in the
    order of execution, of the call with the number ``call`` in CALLS, 0 between two calls.  first: step at which the
    run began or was resumed.  windows: those that have left the block.  stop: 1 where the run is asked to end.
    """

    _fields_ = tuple(
        (name, ctypes.c_int64)
        for name in ("k", "channel_rows", "window_rows", "part", "call", "first", "windows", "stop")
    )


class RunBoard:
    """The status of a run, the blocks of its rows, and the part of its state that the engines count on.

    file: mapped by two processes; made where it does not exist.  None: memory of this process and its forks.
    """

    def __init__(self, program: Program, file: Path | None = None) -> None:
        widths = [1 + len(row.names) for row in (program.channel, program.window)]
        size = ctypes.sizeof(Status) + 8 * BLOCK * sum(widths)
        if file is None:
            self.memory = mmap.mmap(-1, size)
        else:
            if not file.exists():
                file.write_bytes(bytes(size))
            with file.open("r+b") as opened:
                self.memory = mmap.mmap(opened.fileno(), size)
        self.status = Status.from_buffer(self.memory)
        places = [ctypes.sizeof(Status), ctypes.sizeof(Status) + 8 * BLOCK * widths[0]]
        self.channel, self.window = (
            np.frombuffer(self.memory, np.float64, BLOCK * w, at).reshape(BLOCK, w)
            for w, at in zip(widths, places, strict=True)
        )
        self.status.k = -1
        #: called with the rows that leave the blocks, before they leave: of the channels, of the windows
        self.keep: Callable[[list[Array], list[Array]], object] | None = None

    def rows(self) -> tuple[Array, Array]:
        """Return copies of the rows in the blocks; a part may have written over their numbers."""
        counts = (self.status.channel_rows, self.status.window_rows)
        c, w = (n if 0 <= n <= BLOCK else 0 for n in counts)
        return self.channel[:c].copy(), self.window[:w].copy()

    @property
    def full(self) -> bool:
        """Return True if a block has no room for another row."""
        return bool(self.status.channel_rows >= BLOCK or self.status.window_rows >= BLOCK)

    def drain(self, channel_rows: list[Array], window_rows: list[Array]) -> None:
        """Move the rows out of the blocks."""
        channel, window = self.rows()
        if self.keep is not None:
            self.keep([channel], [window])
        if len(channel):
            channel_rows.append(channel)
        if len(window):
            window_rows.append(window)
            self.status.windows += len(window)
        self.status.channel_rows = self.status.window_rows = 0
