"""What a reduction is asked for: all that a report shows, or whether the residuals are ordinary and nothing beside.

    with residuals_alone():
        result = reduce(record)              # of a record that is reduced for each of some dozens of possible mistakes

Then outliers are not looked for, and Allan deviation and spectrum stay empty; coefficients, residuals, their tests and
what is withheld for them are as ever.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from contextvars import ContextVar

_residuals_alone: ContextVar[bool] = ContextVar("residuals_alone", default=False)


@contextlib.contextmanager
def residuals_alone() -> Iterator[None]:
    """Reductions in the block are asked for their residuals alone."""
    token = _residuals_alone.set(True)
    try:
        yield
    finally:
        _residuals_alone.reset(token)


def whole() -> bool:
    """Return whether all is asked for."""
    return not _residuals_alone.get()
