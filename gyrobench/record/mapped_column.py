"""Long columns that stay on the disk: arrays over a file without a name, whose pages come and go."""

from __future__ import annotations

import mmap
import tempfile
from collections.abc import Iterable

import numpy as np

from gyrobench.arrays import AnyArray


def mapped(blocks: Iterable[AnyArray]) -> AnyArray:
    """Return the values of the blocks, one behind the other, as an array that only reads; there is at least one."""
    dtype = np.dtype(float)
    with tempfile.TemporaryFile(prefix="gyrobench-") as file:
        for block in blocks:
            dtype = block.dtype
            file.write(np.ascontiguousarray(block).data)
        file.flush()
        pages = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)  # it lives on without the file's name
    return np.frombuffer(pages, dtype)


def release(values: AnyArray) -> None:
    """Give the memory of a mapped array back; it is read again where it is looked at.  Any other array stays."""
    pages = getattr(values.base, "obj", None)
    if isinstance(pages, mmap.mmap) and hasattr(mmap, "MADV_DONTNEED"):
        pages.madvise(mmap.MADV_DONTNEED)
