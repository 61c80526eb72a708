"""Controllers given as data against scipy.signal, in every form and target; limits without wind-up; refusals."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import signal
from wired import BENCH

from gyrobench.component import ComponentError
from gyrobench.linear.part_linearization import state_space
from gyrobench.packaging import load_part
from gyrobench.packaging.reference import read_reference, run_reference, write_reference

Array = np.ndarray[Any, Any]
StabilizerLti = load_part("stabilizer_lti", BENCH)
H = 1e-3  # s, communication step
TIMES = {"tau1": 0.2, "T1": 2.0, "tau2": 0.03, "T2": 0.003}


def filled(values: Any, *shape: int) -> Any:
    """Return values with zeros up to a shape, as nested lists."""
    given = np.asarray(values, float)
    whole = np.zeros(shape)
    whole[tuple(slice(0, k) for k in given.shape)] = given
    return whole.tolist()


def started(**given: Any) -> Any:
    """Return the part with short lists filled with zeros, initialized."""
    shapes = {"A": (8, 8), "B": (8,), "C": (8,), "num": (9,), "den": (9,)}
    part = StabilizerLti(**{k: filled(v, *shapes[k]) if k in shapes else v for k, v in given.items()})
    part.initialize()
    return part


def played(part: Any, r: Array, h: float = H) -> Array:
    """Return -v after each step, its input held at r."""
    y = np.zeros(r.size)
    for k, x in enumerate(r):
        part.set("u", x)
        part.do_step(k * h, h)
        y[k] = -part.get("v")
    return y


def stable(rng: np.random.Generator, n: int) -> tuple[Array, Array]:
    """Return num, den by falling powers of s: poles up to 300 rad/s, some in pairs; as many zeros, one integral."""
    poles: list[complex] = [0.0]
    while len(poles) < n:
        w, zeta = 10 ** rng.uniform(0.0, 2.5), rng.uniform(0.1, 1.0)
        pair = len(poles) + 2 <= n and rng.random() < 0.5
        poles += [w * complex(-zeta, s * np.sqrt(1 - zeta**2)) for s in (1, -1)] if pair else [-w]
    zeros = -(10 ** rng.uniform(0.0, 2.5, n))
    return rng.uniform(0.5, 2.0) * np.poly(zeros), np.poly(poles).real


@pytest.mark.parametrize("n", range(1, 9))
def test_continuous_is_exact_for_held_inputs(n: int) -> None:
    """Against the exact discrete system by zero-order hold; -v is that of the end of the step, with its input."""
    rng = np.random.default_rng(n)
    num, den = stable(rng, n)
    a, b, c, d = signal.tf2ss(num, den)
    F, G, *_ = signal.cont2discrete((a, b, c, d), H, "zoh")
    r = rng.normal(size=200)
    x, expected = np.zeros(n), []
    for value in r:
        x = F @ x + G[:, 0] * value
        expected.append(c[0] @ x + d[0, 0] * value)
    largest = np.abs(expected).max()
    by_tf = played(started(form=1, num=num[::-1], den=den[::-1], v_max=1e9), r)
    by_ss = played(started(n=n, A=a, B=b[:, 0], C=c[0], D=d[0, 0], v_max=1e9), r)
    assert by_tf == pytest.approx(np.array(expected), abs=1e-9 * largest)
    assert by_ss == pytest.approx(np.array(expected), abs=1e-9 * largest)


@pytest.mark.parametrize("method", ["zoh", "bilinear"])
@pytest.mark.parametrize("n", [1, 3, 6, 8])
def test_sampled_is_that_of_scipy(n: int, method: str) -> None:
    """Every 3 ms on a step of 1 ms, discretized by the part; between the samples v holds."""
    rng = np.random.default_rng(100 + n)
    num, den = stable(rng, n)
    by_hand = signal.cont2discrete(signal.tf2ss(num, den), 3 * H, method)
    _, expected, _ = signal.dlsim((*by_hand[:4], 3 * H), r := rng.normal(size=100))
    part = started(form=1, num=num[::-1], den=den[::-1], Ts=3 * H, discretize=1 if method == "zoh" else 2, v_max=1e9)
    y = played(part, np.repeat(r, 3))
    assert y[2::3] == pytest.approx(expected[:, 0], abs=1e-9 * np.abs(expected).max())
    assert np.array_equal(y[3::3], y[2:-1:3]) and np.array_equal(y[4::3], y[2:-1:3])
    assert y[0] == y[1] == 0.0


def test_sampled_as_given_is_a_difference_equation() -> None:
    """den[0] y_k = sum num_j r_(k-j) - sum den_j y_(k-j), and the same as matrices."""
    rng = np.random.default_rng(7)
    num, den, r = [0.5, -0.2, 0.0, 0.7], [2.0, -1.5, 0.4], rng.normal(size=80)
    expected = signal.lfilter(num, den, r)
    assert played(started(form=1, num=num, den=den, Ts=H, v_max=1e9), r) == pytest.approx(expected, abs=1e-12)
    a, b, c, d = signal.tf2ss(num, [*den, 0.0])
    by_ss = started(n=3, A=a, B=b[:, 0], C=c[0], D=d[0, 0], Ts=H, v_max=1e9)
    assert played(by_ss, r) == pytest.approx(expected, abs=1e-12)


def lead_lag(K: float, tau1: float, T1: float, tau2: float, T2: float, integral: float) -> tuple[Array, Array]:
    """Return num, den by rising powers of s."""
    num = K * np.polymul(np.polymul([tau1, 1.0], [tau2, 1.0]), [1.0, integral])
    return num[::-1], np.polymul(np.polymul([T1, 1.0], [T2, 1.0]), [1.0, 0.0])[::-1]


def test_a_lead_lag_as_data_is_stabilizer_lead_lag() -> None:
    """The voltages of the other part, with test signal and rate command; the linearization is the same too."""
    other = load_part("stabilizer_lead_lag", BENCH)(K=2.0, integral=3.0, K_u=3.0, v_max=1e9, **TIMES)
    other.initialize()
    num, den = lead_lag(2.0, *TIMES.values(), 3.0)
    part = started(form=1, num=num, den=den, K_u=3.0, v_max=1e9)
    rng = np.random.default_rng(3)
    for k in range(300):
        for name, x in zip(("u", "test", "command"), rng.normal(size=3), strict=True):
            part.set(name, x)
            other.set(name, x)
        part.do_step(k * H, H)
        other.do_step(k * H, H)
        assert part.get("v") == pytest.approx(other.get("v"), rel=1e-9)
        assert part.get("e") == other.get("e")
    s = 1j * np.geomspace(1e-2, 1e4, 50)
    ours, theirs = (state_space(p, ["u"], ["v"]) for p in (part, other))
    assert ours(s) == pytest.approx(theirs(s), rel=1e-9)


def test_poles_over_six_decades_keep_seven_digits() -> None:
    """(s + 1)(s + 100)/((s + 0.01)(s + 10)(s + 1e4)) for a step: by its partial fractions, in closed form."""
    poles = np.array([-0.01, -10.0, -1e4])
    residues = [
        (p + 1.0) * (p + 100.0) / np.prod([p - q for q in poles if q != p]) for p in poles
    ]  # of G(s) at each pole
    t = H * np.arange(1, 2001)
    expected = sum(c / p * np.expm1(p * t) for c, p in zip(residues, poles, strict=True))
    y = played(started(form=1, num=np.poly([-1.0, -100.0])[::-1], den=np.poly(poles)[::-1], v_max=1e9), np.ones(t.size))
    assert y == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize("Ts", [0.0, H])
@pytest.mark.long
def test_a_conditioned_controller_does_not_wind_up(Ts: float) -> None:
    """G = 10 (1 + 10/s), limit 1 V, 2 s of r = 1.

    y = 10 r + 100 x; at the limit x' = r + (1 - y)/10 = 0.1 - 10 x, so x = 0.01 in the end, and r = -0.05 makes
    y = -0.5 + 1 at once.  Without conditioning x is 2 s of r = 1, and y stays at its limit.
    """
    given = {"form": 1, "num": [100.0, 10.0], "den": [0.0, 1.0], "v_max": 1.0, "Ts": Ts, "discretize": 2 if Ts else 0}
    r = np.append(np.ones(2000), -0.05)
    with_it, without = played(started(**given, conditioned=1), r), played(started(**given), r)
    assert with_it[1999] == without[1999] == 1.0
    assert without[2000] == 1.0
    assert with_it[2000] == pytest.approx(0.5, abs=1e-2)  # a step of 1 ms later
    small = 1e-3 * np.sin(np.arange(500) / 40.0)  # below the limit conditioning does nothing
    assert np.array_equal(played(started(**given, conditioned=1), small), played(started(**given), small))


CASES: dict[str, dict[str, float]] = {
    "continuous, conditioned, limited": {
        "form": 1, "num[1]": 2.0, "num[2]": 0.5, "num[3]": 0.01, "den[1]": 0.0, "den[2]": 1.0, "den[3]": 0.004,
        "v_max": 0.01, "conditioned": 1, "K_u": 0.5,
    },
    "state space": {"n": 2, "A[1,1]": -3.0, "A[1,2]": 20.0, "A[2,1]": -20.0, "B[2]": 4.0, "C[1]": 1.0, "D": 0.2},
    "held": {"form": 1, "num[1]": 2.0, "num[2]": 0.5, "den[2]": 1.0, "den[3]": 0.01, "Ts": 0.002, "discretize": 1},
    "tustin": {
        "form": 1, "num[1]": 2.0, "num[2]": 0.5, "den[1]": 0.0, "den[2]": 1.0, "Ts": 0.003, "discretize": 2,
        "conditioned": 1, "v_max": 0.01,
    },
    "as given": {"form": 1, "num[1]": 0.5, "num[2]": -0.1, "den[1]": 1.0, "den[2]": -0.9, "Ts": 0.001},
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("target", ["plain", "python", "native", "native-fmi3"])
def test_every_form_has_the_same_bits_in_every_target(tmp_path: Path, case: str, target: str) -> None:
    folder = tmp_path / "components" / "stabilizer_lti"
    folder.mkdir(parents=True)
    file = write_reference("stabilizer_lti", folder / "reference.csv", parameters=CASES[case], rows=101, bench=BENCH)
    assert run_reference(file, target, part="stabilizer_lti", bench=BENCH) == []
    if "v_max" in CASES[case]:  # the limit was met and left
        assert 0.0 < np.mean(read_reference(file).outputs["saturated"]) < 1.0


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"n": 1, "A": [[0.0, 1.0]]}, "numbers beyond n = 1 states"),
        ({"n": 1, "C": [1.0, 2.0]}, "numbers beyond n = 1 states"),
        ({"form": 1, "den": [0.0]}, "den is 0 in every coefficient"),
        ({"form": 1, "num": [0.0, 1.0], "den": [1.0]}, "num has a higher power of s than den"),
        ({"form": 1, "den": [0.0, 1.0], "Ts": H}, "would need values to come"),
        ({"discretize": 1}, "discretize = 1 takes a period"),
        ({"form": 1, "num": [1.0], "den": [1.0, 1.0], "conditioned": 1}, "takes a controller with a direct part"),
        ({"n": 1, "A": [[2.0 / H]], "Ts": H, "discretize": 2}, "a pole at 2/Ts"),
        ({"v_max": 0.0}, "v_max = 0 V must be > 0"),
        ({"n": 9}, "n = 9 1 must be <= 8"),
    ],
)
def test_refuses(given: dict[str, Any], message: str) -> None:
    with pytest.raises(ComponentError, match=message):
        started(**given)


def test_refuses_a_period_that_is_no_multiple_of_the_step() -> None:
    part = started(Ts=1.5 * H)
    with pytest.raises(ComponentError, match=r"Ts = 0\.0015 s must be a whole multiple of the communication step"):
        part.do_step(0.0, H)
