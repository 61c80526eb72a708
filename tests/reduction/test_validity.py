"""Runs without figures: unstable loops, limit cycles, limits active at rest; and those that only look like it."""

from __future__ import annotations

import json
import math
import re
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from gyrobench.record.run_document import LinearModel, LinearModels, LinearPair, PlanRow
from gyrobench.reduction.loops.loop_measures import Gate
from gyrobench.reduction.loops.validity import describe, why_void

DT = 1e-3
T = DT * np.arange(30_000)


def hold(label: str = "drift", **channels: np.ndarray) -> Gate:
    row = PlanRow(phase=1, label=label, mode="hold", dwell=30.0)
    n = len(next(iter(channels.values())))
    return Gate(row, T[:n], slice(0, n), slice(0, 0), {k.replace("__", "."): v for k, v in channels.items()})


def pole(p: complex, step: float = 1e-3) -> LinearModels:
    """A linear model whose poles are p and its conjugate."""
    z = np.exp(p * step)
    a = [[z.real, z.imag], [-z.imag, z.real]]
    model = LinearModel(A=a, B=[[0.0], [0.0]], C=[], D=[], inputs=["x"], outputs=[], states=["1", "2"], step=step)
    return LinearModels(closed=LinearPair(discrete=model))


def test_a_growing_pole_is_named_with_what_it_does_in_a_second() -> None:
    """exp(ln 2) = 2 per s at 10/(2 pi) = 1.59 Hz; the same pole on the left says nothing."""
    assert why_void(pole(math.log(2.0) + 10j), []) == "unstable, pole at 1.59 Hz, grows by a factor of 2 per s"
    assert why_void(pole(-math.log(2.0) + 10j), []) == ""
    assert describe(math.log(3.0) + 0j) == "pole at +1.1 1/s, grows by a factor of 3 per s"


@pytest.mark.parametrize("seed", range(6))
def test_noise_is_no_limit_cycle(seed: int) -> None:
    """White, integrated, and through a resonance of damping 0.01 at 20 Hz: all of them stationary."""
    rng = np.random.default_rng(seed)
    white = rng.normal(size=T.size + 5000)
    r, w = math.exp(-0.01 * 2 * math.pi * 20.0 * DT), 2 * math.pi * 20.0 * DT
    narrow = lfilter([1.0], [1.0, -2.0 * r * math.cos(w), r * r], white)[5000:]
    for y in (white[5000:], np.cumsum(white[5000:]), narrow):
        assert why_void(LinearModels(missing="-"), [hold(loop__e=y)]) == ""


@pytest.mark.parametrize("seed", range(6))
def test_a_limit_cycle_under_noise_is_found_unless_the_linear_model_has_it(seed: int) -> None:
    """A sine of 7.3 Hz of twice the rms of the noise."""
    y = np.sin(2 * np.pi * 7.3 * T) + np.random.default_rng(seed).normal(size=T.size) / math.sqrt(8.0)
    gate = hold(loop__e=y)
    reason = why_void(LinearModels(missing="-"), [gate])
    rounding = Gate(gate.row, gate.t, slice(1, T.size), slice(0, 0), {"loop.e": np.concatenate([[1.0], 1e-12 * y[1:]])})
    assert why_void(LinearModels(missing="-"), [rounding]) == ""
    assert reason.startswith("not settled: loop.e oscillates by ±") and "at 7.3 Hz (limit cycle)" in reason
    assert why_void(LinearModels(missing="-"), [hold("ride", loop__e=y)]) == ""  # there the base moves
    assert why_void(pole(2j * math.pi * 7.3), [hold(loop__e=y)]) == ""  # a nutation that nothing damps


def test_the_limit_cycle_of_a_relay_is_the_describing_functions() -> None:
    """1/(s (0.2 s + 1)(0.02 s + 1)) behind a relay of 1, Euler steps of 0.1 ms.

    The phase is -180 deg at w = 1/sqrt(0.2 * 0.02) = 15.8 rad/s = 2.52 Hz, the gain there 0.2 * 0.02 / 0.22 = 0.01818;
    the relay's 4/(pi A) closes the loop at A = 0.0231.  Second harmonics and the held relay: 10 %.
    """
    x, v, a = 0.1, 0.0, 0.0
    e = np.empty(T.size)
    for k in range(T.size):
        for _ in range(10):
            drive = -1.0 if x > 0.0 else 1.0
            x, v, a = x + 1e-4 * v, v + 1e-4 * (a - v) / 0.2, a + 1e-4 * (drive - a) / 0.02
        e[k] = -x
    reason = why_void(LinearModels(missing="-"), [hold(loop__e=e[T.size // 10 :])])
    size, f = (float(x) for x in re.search(r"by ±([\d.]+) at ([\d.]+) Hz", reason).groups())
    assert size == pytest.approx(0.0231, rel=0.1) and f == pytest.approx(2.52, rel=0.1)


def test_growth_is_found_without_a_linear_model_and_decay_is_not() -> None:
    y = np.sin(2 * np.pi * 3.0 * T)
    grows = why_void(LinearModels(missing="foreign part"), [hold(loop__e=y * np.exp(0.2 * T))])
    assert grows.startswith("not settled: loop.e grows by a factor of 1.22 per s")  # exp(0.2) = 1.2214
    assert why_void(LinearModels(missing="foreign part"), [hold(loop__e=y * np.exp(-0.2 * T))]) == ""


def test_a_limit_that_is_active_at_rest() -> None:
    flags = (np.arange(T.size) % 10 < 6).astype(float)
    reason = why_void(LinearModels(missing="-"), [hold(gyro_a__saturated=flags)])
    assert reason.startswith("not settled: gyro_a is at its limit for 60 % of the time")


# ------------------------------------------------------------------------------- through the product
@pytest.mark.long
def test_an_unstable_run_has_no_figure_and_no_rank(command: Any, tmp_path: Any) -> None:
    """J s2 + ... with K_G = 0.05: its pole is +0.699 1/s by the polynomial of the closed loop, exp(0.699) = 2.01.

    (1 + T1 s)(1 + T2 s) J s2 + K K_G (1 + tau1 s)(1 + tau2 s), friction 0.02 beside, K = 8250.
    """
    lags = np.polymul([2.0, 1.0], [0.003, 1.0])
    leads = np.polymul([0.2, 1.0], [0.03, 1.0])
    roots = np.roots(np.polyadd(np.polymul(lags, [0.5, 0.02, 0.0]), 0.05 * 8250.0 * leads))
    fastest = max(roots, key=lambda p: p.real)
    assert fastest.real == pytest.approx(0.69, abs=0.02)
    name, short = "stabilizer_floated_2dof", ("--set", "hold=5s")
    code, out, _ = command("run", name, "--set", "K_G=0.05", *short, "--strict", "--out", tmp_path / "a")
    assert code == 1
    assert "no value of " in out and f"pole at {abs(fastest.imag) / 2 / math.pi:.2f} Hz" in out
    growth = float(re.search(r"grows by a factor of ([\d.]+) per s", out)[1])
    assert growth == pytest.approx(math.exp(fastest.real), rel=0.02)
    result = json.loads((tmp_path / "a" / "result.json").read_text())
    assert result["verdict"] == "void"
    gain = next(c for c in result["coefficients"] if c["name"] == "rate gain")
    assert (gain["estimate"], gain["u"], gain["verdict"]) == (None, None, "void")
    assert all(c["estimate"] is None for c in result["coefficients"])
