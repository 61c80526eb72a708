"""Errors of encoder, axes, ammeter and time base of the torquer test: simulated, by hand, and as corrections."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from gyrobench import drift, frames
from gyrobench.engine.session import Session
from gyrobench.record.record import Record
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.estimation.effects import PREDICTED
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import Result
from gyrobench.system.system import System, load_system

NAME = "torquer_scale_factor"
ARCSEC = DPH = math.pi / 648000.0
SIZE = 20.0 * ARCSEC  # 9.696e-5 rad
SHORT = {"currents": "5 10 20 40 70 100", "range": "0.5deg", "range_large": "5deg", "windows": 10}


def load() -> System:
    return load_system(NAME)


def values(more: dict[str, Any]) -> dict[str, Any]:
    still = {f"gyro.{n}": 0.0 for n in drift.terms(9)}  # g coefficients would see the axis lean, too
    return {**SHORT, **dict.fromkeys(load().noises, 0.0), **still, "gyro.white": 1e-10, **more}


def reduced(session: Session, more: dict[str, Any], corrections: str = "") -> Result:
    given = values({**more, "corrections": corrections})
    return load().with_values(given).reduce(session.run(given, seed=1))


def turned(axis: int) -> list[list[float]]:
    rows: list[list[float]] = frames.rotation(np.eye(3)[axis], SIZE).T.tolist()
    return rows


CASES = [
    # over angles from 0 on, e (sin b - sin a)/(b - a) = e cos of the middle: 9.696e-5 of K at small angles; twice a
    # turn 1.939e-4
    ({"table.encoder_amplitude[1]": SIZE}, "angle error, once a turn (sine)", {"K": 9.696e-5, "K_1": 9.696e-5}),
    ({"table.encoder_amplitude[2]": SIZE}, "angle error, twice a turn (sine)", {"K": 1.939e-4}),
    # the axis sees 15.041 deg/h times 9.696e-5, and the table turns back by it
    ({"table.tilt[2]": SIZE}, "table axis towards the pole", {"drift": -1.4584e-3}),
    ({"gyro.mount": turned(2)}, "input axis towards output axis", {"drift": -1.4584e-3}),
]  # fmt: skip


@pytest.mark.parametrize(("error", "source", "by_hand"), CASES, ids=[c[1] for c in CASES])
@pytest.mark.long
def test_an_error_is_predicted_and_taken_out(
    session: Session, error: dict[str, Any], source: str, by_hand: dict[str, float]
) -> None:
    """By hand to 1 % (K relative, drift in deg/h), in the report of the run, and out of the estimates again."""
    plain, wrong = reduced(session, {}), reduced(session, error)
    right = reduced(session, error, f"{source} = 20(1) arcsec")
    (said,) = [t for t in wrong.tables if t.id == PREDICTED]
    shift = {row[0]: row[-3] for row in said.rows}
    for name, x in by_hand.items():
        size = plain[name].estimate if name.startswith("K") else 1.0
        off, left = ((r[name].estimate - plain[name].estimate) / size for r in (wrong, right))
        assert off == pytest.approx(x, rel=0.01)
        assert abs(left) < 0.01 * abs(x)
        assert shift[name] / size == pytest.approx(x, rel=0.01)
        assert math.sqrt(right[name].u ** 2 - right[name].u_a ** 2) / size == pytest.approx(abs(x) / 20.0, rel=0.02)
    assert {b.source for b in right.budget if b.coefficient in by_hand} >= {source}


def test_ammeter_and_time_base_by_hand(session: Session) -> None:
    """An ammeter that shows too much by 1e-3 makes K small by as much, one whose zero is 0.1 mA too high is a drift of
    -17.2 deg/h/mA 0.1 mA; seconds read 1e-4 too long make all rates 1e-4 too small.
    """
    given = values({"u_current": 1e-3, "u_zero": 1e-4, "u_time": 1e-4})
    r = load().with_values(given).reduce(session.run(given, seed=1))
    part = {(b.source, b.coefficient): (b.sensitivity, b.contribution) for b in r.budget}
    K = r["K"].estimate
    assert part["ammeter", "K"] == pytest.approx((-K, 1e-3 * K), rel=1e-6)
    assert part["time base", "K"] == pytest.approx((-K, 1e-4 * K), rel=1e-6)
    assert part["zero of the ammeter", "drift"] == pytest.approx((-17200.0, 1.72), rel=1e-6)
    assert ("zero of the ammeter", "K") not in part
    assert r["K"].u == pytest.approx(math.hypot(1e-3, 1e-4) * K, rel=1e-3)


@pytest.mark.long
def test_stated_errors_of_the_encoder_are_held(session: Session) -> None:
    """Thirty records whose angles are read with 20 arcsec once a turn: stated, 0.86 or more of the intervals of K, K_1
    and K_LS hold; not stated, less than half of those of K_LS.
    """
    record = session.run(values({"gyro.white": 1e-8}), seed=1)
    rng, held = np.random.default_rng(2), np.zeros((2, 3))
    for seed in range(30):
        a, b = SIZE * rng.normal(size=2)
        windows = dict(record.windows)
        jitter = 1e-7 * rng.normal(size=len(windows["angle_end"]))
        for n in ("angle_start", "angle_end"):
            x = record.windows[n]
            windows[n] = x + a * np.sin(x) + b * np.cos(x) + (jitter if n == "angle_end" else np.roll(jitter, 1))
        for k, size in enumerate((SIZE, 0.0)):
            options = {**record.run.options, "u_angle1": size}
            r = load().reduce(Record(windows, record.channels, record.run.replace(options=options, seed=seed)))
            held[k] += [abs(r[n].estimate - 17.2) <= r[n].k * r[n].u for n in ("K", "K_1", "K_LS")]
    assert held[0].min() >= 26 and held[1, 2] < 15


def test_a_table_of_rates_takes_no_corrections() -> None:
    rows = {n: np.array(v) for n, v in {"current": [1.0, 2.0, 3.0], "rate_plus": [1.0, 2.0, 3.0],
                                        "rate_minus": [1.0, 2.0, 3.0]}.items()}  # fmt: skip
    options = {"corrections": "angle error, once a turn (sine) = 1(1) arcsec"}
    record = Record(rows, {}, RunDocument(system=NAME, measured=True, options=options))
    with pytest.raises(ReductionError, match="a table of rates has no angles to correct"):
        load().reduce(record)
