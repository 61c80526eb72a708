"""Errors of encoder, table axis and mount of the pickoff test: simulated, predicted by hand, entered as corrections."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from pickoffs import DPH, R, load, made

from gyrobench import drift, frames
from gyrobench.engine.session import Session
from gyrobench.reduction.estimation.effects import PREDICTED
from gyrobench.result import Result

NAME = "pickoff_scale_factor"
ARCSEC = math.pi / 648000.0
MINUTE = 60.0 * ARCSEC  # 2.909e-4 rad


def reduced(session: Session, values: dict[str, Any], corrections: str = "") -> Result:
    quiet = dict.fromkeys(load().noises, 0.0)
    still = {f"gyro.{n}": 0.0 for n in drift.terms(9)}  # g coefficients would see the axis lean, too
    given = {**quiet, **still, "gyro.white": 1e-11, **values, "corrections": corrections}
    return load().with_values(given).reduce(session.run(given, seed=1))


CASES = [
    # what is read is a (1 + e) for small angles, once a turn, and a (1 + 2 e), twice: S is smaller by e, by 2 e
    ({"table.encoder_amplitude[1]": MINUTE}, "angle error, once a turn (sine)", {"S": -2.909e-4}),
    ({"table.encoder_amplitude[2]": MINUTE}, "angle error, twice a turn (sine)", {"S": -5.818e-4}),
    # the axis sees 15.041 deg/h times e: the float turns with it as with a drift of -15.041 e
    ({"table.tilt[2]": MINUTE}, "table axis towards the pole", {"drift": -4.3755e-3}),
    # the gyro turned about its spin axis: the input axis leans towards the output axis, which lies on the pole
    ({"gyro.mount": frames.rotation(np.eye(3)[2], MINUTE).T.tolist()}, "input axis towards output axis",
     {"drift": -4.3755e-3}),
]  # fmt: skip


@pytest.mark.parametrize(("error", "source", "by_hand"), CASES, ids=[c[1] for c in CASES])
def test_an_error_is_predicted_and_taken_out(
    session: Session, error: dict[str, Any], source: str, by_hand: dict[str, float]
) -> None:
    """By hand to 0.1 % (S relative, drift in deg/h), in the report of the run, and out of the estimates again."""
    plain, wrong = reduced(session, {}), reduced(session, error)
    right = reduced(session, error, f"{source} = 60(1) arcsec")
    (said,) = [t for t in wrong.tables if t.id == PREDICTED]
    shift = {row[0]: row[-3] for row in said.rows}
    for name, x in by_hand.items():
        size = plain["S"].estimate if name == "S" else 1.0
        off, left = ((r[name].estimate - plain[name].estimate) / size for r in (wrong, right))
        assert off == pytest.approx(x, rel=2e-3)
        assert abs(left) < 2e-3 * abs(x)
        assert shift[name] / size == pytest.approx(x, rel=2e-3)
        # the correction brings its own u: 1 arcsec
        assert math.sqrt(right[name].u ** 2 - right[name].u_a ** 2) / size == pytest.approx(abs(x) / 60.0, rel=0.02)


def test_angles_gone_over_once_take_the_earth_for_slope(session: Session) -> None:
    """One way, what the axis sees of the Earth looks like the slope: rate times the time of the test over the span."""
    plain, wrong = (reduced(session, {"both_ways": False, **e}) for e in ({}, {"table.tilt[2]": 10.0 * MINUTE}))
    right = reduced(session, {"both_ways": False, "table.tilt[2]": 10.0 * MINUTE},
                    "table axis towards the pole = 10(0.1) arcmin")  # fmt: skip
    off, left = (r["S"].estimate - plain["S"].estimate for r in (wrong, right))
    assert off > 0.0 and abs(left) < 1e-2 * off


def record(rng: np.random.Generator, encoder: float) -> dict[str, Any]:
    """Readings there and back, 1 uV of noise, of an encoder that reads too much by random sines once a turn."""
    ideal = made(n=21, every=0.2)
    a = ideal["angle_start"]
    p, q = encoder * rng.normal(size=2)
    read = a + p * np.sin(a) + q * np.cos(a)
    u = ideal["mean"] + 1e-6 * rng.normal(size=a.size)
    return {**ideal, "angle_start": read, "angle_end": read, "mean": u}


@pytest.mark.long
def test_stated_errors_of_the_encoder_are_held() -> None:
    """Forty records with 30 arcsec once a turn (1.5e-4 of S, ten times its u of type A): 0.87 or more are held where
    it is stated, less than a third where it is not.
    """
    rng = np.random.default_rng(4)
    held = np.zeros((2, 3))
    for _ in range(40):
        windows = record(rng, 30.0 * ARCSEC)
        for k, size in enumerate((30.0 * ARCSEC, 0.0)):
            r = R.Reduction.reduce(windows, R.PickoffSetup(gain=1.0, drift=2.0 * DPH, sizes={"u_angle1": size}))
            pairs = ((r["S"], 12.0), (r["K_sg"], 12.0), (r["drift"], 0.7))
            held[k] += [abs(c.estimate - x) <= c.k * c.u for c, x in pairs]
    assert held[0].min() >= 35 and held[1, 0] < 13
