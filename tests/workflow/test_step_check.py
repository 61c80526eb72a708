"""Which step a check takes beside that of the run."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from gyrobench.workflow.run_execution import check_step


def checked(jitter: Any, short: bool) -> Any:
    """Return the check at a step of 1 s of a system whose run at a step h has the jitter jitter(h)."""
    system = SimpleNamespace(
        noises=[], options={}, reduce=lambda h: SimpleNamespace(coefficients=[coefficient("jitter", "rad", jitter(h))])
    )
    session = SimpleNamespace(assembly=SimpleNamespace(bindings={}), run=lambda values, seed, h, folder, progress: h)
    return check_step(session, system, 1, 1.0, short=short)  # type: ignore[arg-type]


def coefficient(name: str, unit: str, estimate: float) -> Any:
    return SimpleNamespace(name=name, unit=unit, estimate=estimate, no_value="")


@pytest.mark.parametrize(
    ("jitter", "short", "other", "change"),
    [
        (lambda h: 1.0 + 0.1 * h, True, 2.0, 0.1),  # first order: (1.1 - 1.2)/(1 - 2)
        (lambda h: 1.0 + 0.1 * h, False, 0.5, 0.1),  # (1.1 - 1.05)/(1 - 1/2)
        (lambda h: 1.0 + 0.1 * h if h < 2.0 else 50.0, True, 0.5, 0.1),  # hunts at 2: 48.9 are no effect of 1.1
    ],
)  # fmt: skip
def test_a_step_at_which_a_loop_hunts_is_no_measure(jitter: Any, short: bool, other: float, change: float) -> None:
    check = checked(jitter, short)
    assert check.other == other and [r.change for r in check.rows] == [pytest.approx(change)]
