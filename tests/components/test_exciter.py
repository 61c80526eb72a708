"""The exciter: stages in time, shapes against their formulas, derivatives, refusals."""

import math

import pytest
from wired import BENCH

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

Exciter = load_part("exciter", BENCH)
H = 1e-3
FIELDS = ("kinds", "shapes", "axes", "amplitudes", "frequencies", "settle", "dwell")
BLANK = dict(zip(FIELDS, (0, 0, 1, 0.0, 0.0, 0.0, 1.0), strict=True))


def exciter(*phases):
    part = Exciter(
        phases=len(phases), **{f: [{**BLANK, **p}[f] for p in phases] + [BLANK[f]] * (99 - len(phases)) for f in FIELDS}
    )
    part.initialize()
    return part


def run(part, signal, until):
    """Rows (t, signal, gate, phase, done) at the sample times, the first at t = 0."""
    names = [signal, "gate", "phase", "done"]
    rows = [(0.0, *map(part.get, names))]
    for k in range(round(until / H)):
        part.do_step(k * H, H)
        rows.append(((k + 1) * H, *map(part.get, names)))
    return rows


def test_step_torque_is_there_while_the_gate_is_open():
    part = exciter({"kinds": 1, "shapes": 1, "axes": 2, "amplitudes": 0.3, "settle": 0.01, "dwell": 0.02})
    for t, x, gate, _, done in run(part, "torque[2]", 0.05):
        open_ = 0.01 - 1e-9 < t < 0.03 - 1e-9
        assert (x, gate) == ((0.3, 1.0) if open_ else (0.0, 0.0)), t
        assert done == (1.0 if t > 0.03 - 1e-9 else 0.0)


def test_constant_is_there_from_the_start_of_its_phase_to_the_next():
    part = exciter(
        {"kinds": 2, "amplitudes": 1e-3, "axes": 3, "settle": 0.01, "dwell": 0.02}, {"settle": 0.005, "dwell": 0.005}
    )
    rows = run(part, "command[3]", 0.045)
    assert all(x == (1e-3 if t < 0.03 - 1e-9 else 0.0) for t, x, *_ in rows)
    assert [p for *_, p, _ in rows].index(2.0) == 30


def test_sine_fades_in_and_out():
    """A w(s) sin(2 pi f s) with w = (1 - cos(2 pi s / T)) / 2 up to s = T/2, then 1, and (1 + cos(2 pi s' / T)) / 2."""
    f, settle, dwell = 40.0, 0.05, 0.1
    part = exciter({"kinds": 3, "shapes": 2, "amplitudes": 2.0, "frequencies": f, "settle": settle, "dwell": dwell})
    for t, x, gate, _, done in run(part, "test[1]", 0.25):
        if t < settle / 2:
            w = 0.5 - 0.5 * math.cos(2 * math.pi * t / settle)
        elif t < settle + dwell - 1e-9:
            w = 1.0
        else:
            w = 0.5 + 0.5 * math.cos(math.pi * min(1.0, 2 * (t - settle - dwell) / settle))
        assert x == pytest.approx(2.0 * w * math.sin(2 * math.pi * f * t), abs=1e-12)
        assert gate == (1.0 if settle - 1e-9 < t < settle + dwell - 1e-9 else 0.0)
        assert done == (1.0 if t > 1.5 * settle + dwell - 1e-9 else 0.0)


@pytest.mark.parametrize(
    "phase",
    [
        {"shapes": 2, "frequencies": 20.0, "settle": 0.1, "dwell": 0.2},
        {"shapes": 1, "frequencies": 10.0, "settle": 0.02, "dwell": 0.3},
    ],
)
def test_base_motion_is_its_own_derivative(phase):
    """Central differences of the angle and of the rate: their error is h2/6 of the third derivative, at most
    A w3 h2 / 6 (w = 2 pi f; the raised cosine doubles it at most)."""
    part = exciter({"kinds": 4, "amplitudes": 0.1, **phase})
    rows = []
    for k in range(500):
        part.do_step(k * H, H)
        rows.append([part.get(f"motion_{n}[1]") for n in ("angle", "rate", "acceleration")])
    w = 2 * math.pi * phase["frequencies"]
    for below, here, above in zip(rows, rows[1:], rows[2:], strict=False):
        assert (above[0] - below[0]) / (2 * H) == pytest.approx(here[1], abs=0.1 * w**3 * H**2)
        assert (above[1] - below[1]) / (2 * H) == pytest.approx(here[2], abs=0.1 * w**4 * H**2)
    assert rows[-1] == [0.0, 0.0, 0.0]
    assert max(r[0] for r in rows) == pytest.approx(0.1, rel=1e-2)


@pytest.mark.parametrize(
    ("phase", "says"),
    [
        ({"kinds": 5}, "phase 1: unknown kind"),
        ({"shapes": 3}, "phase 1: unknown shape"),
        ({"axes": 4}, "axis must be 1, 2 or 3"),
        ({"dwell": 0.0}, "needs a dwell above 0 s"),
        ({"kinds": 1, "shapes": 2}, "a sine needs a frequency"),
        ({"kinds": 4}, "a constant rotation would be a jump"),
        ({"kinds": 4, "shapes": 2, "frequencies": 1.0}, "needs a settling time"),
        ({"kinds": 4, "shapes": 1, "frequencies": 1.0}, "at least 2 / frequency"),
    ],
)
def test_refusals(phase, says):
    with pytest.raises(ComponentError, match=says):
        exciter(phase)
