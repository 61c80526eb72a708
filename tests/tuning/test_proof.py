"""Gain margins of a proof: limits at low gain, limits that drown in noise, and where a simulation becomes unstable."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from gyrobench.bench import Bench
from gyrobench.engine.session import Session
from gyrobench.reduction.loops.loop_measures import Point
from gyrobench.system.loop_plan import LoopPhase, LoopPlan
from gyrobench.system.system import load_system
from gyrobench.tuning.loop_ports import loops_of
from gyrobench.tuning.proof import Proof, ProvenWish, _gain_margin, _run, loop_plan, proof_of, sine_frequencies
from gyrobench.tuning.robustness import gain_limits, grid
from gyrobench.tuning.tuned_settings import quiet
from gyrobench.tuning.wishes import parse_wishes

WISHES = parse_wishes(["gain margin=6dB", "S at 1Hz<-10dB"])
F = np.geomspace(1e-3, 2000.0, 4000)


def loop(f: np.ndarray) -> np.ndarray:
    """Return 1/s3 at first, crossing near 20 Hz, with a delay of 0.3 ms.

    Limits: down where atan(6/w) + atan(5/w) = 90 degrees, w = sqrt 30, 0.87 Hz; up near 830 Hz.
    """
    s = 2j * np.pi * f
    return 126.0 / s * (1.0 + 6.0 / s) * (1.0 + 5.0 / s) * np.exp(-3e-4 * s)


def test_a_slow_limit_that_counts_has_sines() -> None:
    """Down at 0.87 Hz, 23 times slower than the crossover, by 33 dB, and up by 32 dB: both are measured."""
    L = loop(F)
    slow, fast = gain_limits(F, L)
    assert abs(slow[0] - math.sqrt(30.0) / (2.0 * math.pi)) < 0.02 and fast[1] < 1.0 / slow[1] < 1.5 * fast[1]
    sines = sine_frequencies(F, L, WISHES, 1e-4)
    assert sum(abs(math.log(x / slow[0])) < 0.1 for x in sines) >= 3
    without = [w for w in WISHES if w.name != "gain margin"]
    assert not any(abs(math.log(x / slow[0])) < 0.1 for x in sine_frequencies(F, L, without, 1e-4))


def test_sines_reach_down_to_a_wanted_gain_margin_whose_limit_no_sine_reaches() -> None:
    """K h/(z - 1), K = 40/s, with an integral: its limit is at 500 Hz, sines end at 200 Hz; |L| is 0.9/8 at 57 Hz."""
    h = 1e-3
    f = grid(h, 5.0)
    step = h / (np.exp(2j * np.pi * f * h) - 1.0)
    L = 40.0 * step * (1.0 + 30.0 * step)
    assert [at for at, _ in gain_limits(f, L)] == pytest.approx([500.0])
    tops = [max(sine_frequencies(f, L, parse_wishes([w, "S at 1Hz<-3dB"]), h)) for w in ("gain margin=8", "peak S<6dB")]
    assert tops[0] == pytest.approx(57.0, rel=0.05) and tops[1] < 30.0


def test_a_limit_in_noise_is_a_bound() -> None:
    """The sines beyond 250 Hz are lost: all that is sure is 1/|L| there, 126/(2 pi 250) = 1/12.5, 21.9 dB, or more."""
    L = loop(F)
    f = np.array([1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 250.0])
    points = [Point(x, complex(v), 1e-4, 1.0) for x, v in zip(f, loop(f), strict=True)]
    got = _gain_margin(WISHES[0], points, [400.0, 830.0], F, L)
    assert got.bound and got.agrees and got.kept
    assert abs(got.value / 12.47 - 1.0) < 0.01
    turned = [*points, Point(700.0, complex(-abs(loop(np.array([700.0]))[0]) * np.exp(-0.3j)), 0.6, 0.9)]
    noisy = _gain_margin(WISHES[0], turned, [830.0], F, L)
    assert noisy.agrees and 0.3 * noisy.value < noisy.U


def test_limits_that_are_measured_are_no_bound() -> None:
    """Both limits within the points: the smaller one, of its own two sides, within 2 % of the loop's."""
    L = loop(F)
    slow, fast = gain_limits(F, L)
    f = [*(slow[0] * q for q in (0.8, 0.93, 1.0, 1.07, 1.2)), 2.0, 5.0, 10.0, 20.0, 60.0, 150.0, 300.0,
         *(fast[0] * q for q in (0.93, 1.0, 1.07))]  # fmt: skip
    points = [Point(x, complex(v), 1e-5, 1.0) for x, v in zip(f, loop(np.array(f)), strict=True)]
    got = _gain_margin(WISHES[0], points, [], F, L)
    assert not got.bound and abs(got.value / min(1.0 / slow[1], fast[1]) - 1.0) < 0.02


def test_sines_lost_on_one_side_bound_that_side_alone() -> None:
    """A limit down in noise: 1.5 Hz is the slowest sine that counts, |L| there in exact numbers, and nothing of the up.

    |L(1.5 Hz)| = 126/w sqrt(1 + 36/w2) sqrt(1 + 25/w2) with w = 9.4248 rad/s: 13.369 * 1.18545 * 1.13201 = 17.94.
    """
    L = loop(F)
    f = np.array([1.5, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 250.0, 600.0, 800.0, 900.0])
    points = [Point(x, complex(v), 1e-4, 1.0) for x, v in zip(f, loop(f), strict=True)]
    lost = _gain_margin(WISHES[0], points, [0.81, 0.87], F, L)
    assert lost.bound and abs(lost.value / 17.94 - 1.0) < 1e-3
    short = _gain_margin(WISHES[0], points[:8], [0.81, 0.87], F, L)  # and the limit up lies behind 250 Hz: 12.5
    assert short.bound and abs(short.value / 12.47 - 1.0) < 0.01
    # a loop without a limit up: slow sines that are lost do not make one of the fastest, |L(20 Hz)| = 1/0.98
    F_low = np.geomspace(1e-3, 30.0, 2000)
    none = _gain_margin(WISHES[0], points[:6], [0.81, 0.87], F_low, loop(F_low))
    assert none.bound and abs(none.value / 17.94 - 1.0) < 1e-3


def test_a_measure_that_tells_nothing_proves_nothing() -> None:
    """Of 40 degrees that are wanted, 66 +- 110 degrees were "proven"; an interval that lies above them tells all."""
    wish = parse_wishes(["phase margin=40deg", "bandwidth>1Hz"])[0]

    def proof(value: float, U: float, bound: bool = False) -> Proof:
        measured = ProvenWish(wish, math.radians(value), math.radians(U), math.radians(66.0), bound)
        return Proof({}, (measured,), (), 20, "", "", None)

    assert [proof(*x).holds for x in ((66.0, 110.0), (66.0, 20.0), (45.0, 9.0), (30.0, 5.0))] == [
        False,
        True,
        True,
        False,
    ]
    words = [proof(*x).wishes[0].verdict for x in ((66.0, 110.0), (30.0, 5.0), (30.0, 0.0, True), (50.0, 0.0, True))]
    assert [w[:8] for w in words] == ["not told", "below wh", "not told", ""]


@pytest.mark.parametrize("name", ["platform_single_axis", "gimbal_tracking"])
def test_a_recorded_motion_waits_for_the_ride(name: str, tmp_path: Path) -> None:
    """The base rests while the test sines of a proof are measured; a run of the system begins with the recording."""
    file = tmp_path / "ride.csv"
    file.write_text("time [s],pitch [deg]\n0,0\n1,1\n2,0\n", encoding="utf-8")
    system = load_system(name).with_values({"profile": str(file)})
    assert system.recorded_motion()["motion.profile_t"] == [0.0, 1.0, 2.0]
    plan, _ = loop_plan(system, [3.0, 6.0], lambda f: 0.1)
    vars(system).update(plan=lambda: plan)
    assert system.recorded_motion()["motion.profile_t"][0] == pytest.approx(sum(p.duration() for p in plan.phases))


@pytest.mark.long
def test_a_promised_gain_margin_is_where_the_simulation_becomes_unstable() -> None:
    """Conditionally stable loop of a platform whose own test begins with a flight: the base rests in the proof.

    41.35 dB down, at 0.145 Hz, by another road: L = 10/(s (1 + 2 ms s)) G(s) of scipy's equations, and by runs of the
    co-simulation 1 dB before and behind it, without a test sine.
    """
    system = load_system("platform_three_gimbal").with_values({})
    K, tau1, T1, tau2, T2, integral = 13.2476832, 1.57941686, 5.89038166, 0.110800607, 0.0964965492, 2.08165792
    values = {"K": K, "tau1": tau1, "T1": T1, "tau2": tau2, "T2": T2, "integral": integral}
    settings = {f"pitch.{n}": v for n, v in values.items()}
    f = np.geomspace(0.02, 900.0, 1500)
    s = 2j * np.pi * f
    G = K * (1 + tau1 * s) * (1 + tau2 * s) / ((1 + T1 * s) * (1 + T2 * s)) * (1 + integral / s)
    L = 10.0 / (s * (1.0 + 2e-3 * s)) * G
    with quiet(), Session(system, bench=Bench.find().folder, child=True) as session:
        proof = proof_of(session, settings, {}, f, L, G, WISHES[:1], ports=loops_of(system)["pitch"])
        margin = proof.wishes[0]
        assert not proof.limits and not margin.bound and margin.agrees
        assert 20.0 * math.log10(margin.value) == pytest.approx(41.35, abs=0.05)

        def growth(decibels: float) -> float:
            """Return how the swing of a load step grows over 100 s, at another gain."""
            plan = LoopPlan([LoopPhase("kick", "torque", "step", 1, 0.1, settle=0.1, dwell=130.0)])
            record = _run(session, settings | {"pitch.K": K * 10.0 ** (decibels / 20.0)}, {}, plan, 0.01, 1)
            angle = record.channels["platform.attitude[1]"]
            return float(np.std(angle[-3000:]) / np.std(angle[1000:4000]))

        assert growth(-42.35) > 1.5 > 0.75 > growth(-40.35)


def test_a_wish_at_most_is_missed_above_it() -> None:
    """123.2 rad of a jitter of at most 100 lies above, 28 of a margin of at least 40 below."""
    jitter, margin = parse_wishes(["jitter=100urad", "phase margin=40deg"])
    assert ProvenWish(jitter, 123.2e-6, 1.8e-6, 131e-6).verdict == "above what is wanted"
    assert ProvenWish(margin, 0.49, 0.006, 0.52).verdict == "below what is wanted"
