"""A loop of a gimbal tuned for the jitter of its line of sight: model, search, proof, dry friction."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from gyrobench.bench import Bench, UsageError
from gyrobench.engine.session import Session
from gyrobench.packaging import load_part
from gyrobench.system.system import load_system
from gyrobench.tuning.loop_ports import LoopPorts, loops_of
from gyrobench.tuning.plant import HeldController, plants
from gyrobench.tuning.proof import loop_plan
from gyrobench.tuning.sight_jitter import MovedSight, SightWays, finer, sight_models
from gyrobench.tuning.structures import rounded
from gyrobench.tuning.tune_loop import tune
from gyrobench.tuning.tuning_notes import slower
from gyrobench.tuning.wishes import Wish

F = np.geomspace(0.05, 1000.0, 3000)


def gimbal(of: str = "gimbal_stabilization", **values: object):
    """Return the gimbal with options set."""
    system = load_system(of)
    for name, x in values.items():
        system.set(name, x)
    return system


def models(axis: str, of: str = "gimbal_stabilization", at: Any = None, **values: object):
    """Return the plant, the sight model, the system's own controller over F and its parameters.

    at: point of a spread, of the sight model.
    """
    system = gimbal(of, **values)
    ports = loops_of(system)[axis]
    with Session(system, bench=Bench.find().folder, child=True) as session:
        now, _, document = session.prepare()
        q = document.parameters
        sources = now.line_of_sight(q)

        def part_of(slot: str):
            return load_part(session.names[slot])

        plant = plants(session.assembly, {**q, **sources.free}, part_of, now.step, [{}], ports)[0]
        sight = sight_models(session.assembly, q, part_of, now.step, [at or {}], ports, now.line_of_sight)[0]
    if f"{axis}.num" in q:
        num, den = np.array(q[f"{axis}.num"]), np.array(q[f"{axis}.den"])
    else:  # the design of a tracking loop has an integral alone
        num = q[f"{ports.slot}.K"] * np.array([q[f"{ports.slot}.integral"], 1.0])
        den = np.array([0.0, 1.0])
    G = HeldController(rounded(num, den, {}), now.step)
    return plant, sight, G.response(np.exp(2j * np.pi * F * now.step)), q


def test_the_loops_of_a_gimbal() -> None:
    assert loops_of(gimbal()) == {
        "pitch": LoopPorts("pitch", "pitch", 1, "platform.los[1]"),
        "yaw": LoopPorts("yaw", "yaw", 3, "platform.los[2]"),
    }


def test_a_recorded_ride_begins_with_the_ride_of_a_proof(tmp_path) -> None:
    """Not at the start, where the test sines of the proof would meet it and the ride would find it over."""
    file = tmp_path / "ride.csv"
    file.write_text("time [s],pitch [deg]\n" + "".join(f"{k},{k % 2}\n" for k in range(90)), encoding="utf-8")
    system = gimbal(profile=str(file))
    with Session(system, bench=Bench.find().folder, child=True) as session:
        alone = session.prepare()[2].parameters["motion.profile_t"][:3]
        plan, _ = loop_plan(session.system, [3.0, 6.0], lambda f: 0.1, ride="ride")
        vars(session.system).update(plan=lambda: plan)
        behind = session.prepare()[2].parameters["motion.profile_t"][:3]
    *ahead, ride = plan.phases
    began = sum(p.duration() for p in ahead)
    assert ride.label == "ride" and [p.amplitude for p in ahead if p.shape == "sine"] == [0.1, 0.1]
    assert list(alone) == [0.0, 1.0, 2.0] and list(behind) == pytest.approx([began, began + 1.0, began + 2.0])


@pytest.mark.parametrize("axis", ["pitch", "yaw"])
@pytest.mark.long
def test_the_model_without_controller_makes_the_loop(axis: str) -> None:
    """-G Q is G times the plant, which is made by another road."""
    plant, sight, G, _ = models(axis, pitch=0.5)
    ways = sight.at(F)
    L = plant.response(F) * G
    use = F >= 1.0
    assert -G[use] * ways.back[np.isin(ways.f, F)] == pytest.approx(L[use], rel=1e-6)
    assert ways.f[0] == F[use][0]


@pytest.mark.long
def test_a_spread_moves_what_the_sources_are_set_by() -> None:
    """Twice the noise of the gyro and three times the vibration, at a point of the spread, make as much of jitter."""
    _, sight, G, _ = models("pitch")
    _, there, _, _ = models("pitch", at={"gyro.white": 2 * math.radians(0.005) / math.sqrt(2), "vibration.scale": 3.0})
    before, after = sight.at(F).sources(G), there.at(F).sources(G)
    assert after["noise of the gyro"] == pytest.approx(2 * before["noise of the gyro"], rel=1e-9)
    base = "motion of the base about x"
    assert after[base] == pytest.approx(3 * before[base], rel=1e-9)


@pytest.mark.long
def test_allowances_of_a_tuned_loop_hold_in_the_worst_case() -> None:
    """Each source at its allowance, by models of its own: the worst of the spread is the jitter that was wanted."""
    tones = {"phase margin": "40deg", "jitter": "60urad"}
    over = ["platform.bending[1]=±10%", "gyro.white=±30%"]
    wishes = [f"{n}={x}" for n, x in tones.items()]
    found = tune(gimbal(jitter_from=2.0, ride=20.0), wishes, over, structure="pi+notch", loop="pitch")
    by_name = {a.set_by.name: a for a in found.allowed}
    gyro, base = by_name["gyro_noise"], by_name["psd, rate_x"]
    assert isinstance(gyro.most, float) and isinstance(base.most, float)
    white = math.radians(gyro.most) / math.sqrt(2)
    corners = [dict(p) for p in found.points if p]

    def worst(each: list[dict[str, float]], scale: float = 1.0) -> float:
        G = HeldController(rounded(found.controller.num, found.controller.den, {}), 2e-4)
        f = np.union1d(F, [2.0])  # from where the jitter counts
        response = G.response(np.exp(2j * np.pi * f * 2e-4))
        given = {"jitter_from": 2.0, "ride": 20.0}
        ways = [models("pitch", at=at, **given)[1].at(f) for at in each]
        squares = [w.sources(response) for w in ways]
        return max(math.hypot(s["noise of the gyro"], scale * s["motion of the base about x"]) for s in squares)

    assert 1e6 * worst([{**at, "gyro.white": white} for at in corners]) == pytest.approx(60.0, rel=1e-3)
    assert 1e6 * worst(corners, math.sqrt(base.most)) == pytest.approx(60.0, rel=1e-3)
    assert "jitter by source" in str(found) and f"{gyro.most:.3g} °/s/√Hz" in str(found)


@pytest.mark.long
def test_jitter_by_hand() -> None:
    """No mode, no vibration: line of sight = T n / s, T = L/(1 + L), L = G F k/(J s).

    J = 0.05 kg.m2, k = 0.4 N.m/V; from 1 Hz on, white noise of 0.005 deg/s/sqrt(Hz).  The step of 0.2 ms: 2 %.
    """
    _, sight, G, q = models("pitch", bending=0.0, psd="none")
    s = 2j * np.pi * F
    low_pass = 1.0 / (1.0 + math.sqrt(2.0) * s / (200 * np.pi) + (s / (200 * np.pi)) ** 2)
    num, den = (np.polynomial.polynomial.polyval(s, np.array(q[f"pitch.{n}"])) for n in ("num", "den"))
    L = num / den * low_pass * 0.4 / (0.05 * s + 0.01)
    density = np.abs(num / den * low_pass * 0.4 / (0.05 * s + 0.01) / s / (1 + L)) ** 2 * math.radians(0.005) ** 2
    use = F >= 1.0
    by_hand = math.sqrt(np.trapezoid(density[use], F[use]))
    assert sight.at(F).rms(G) == pytest.approx(by_hand, rel=0.02)
    assert set(sight.at(F).sources(G)) == {f"motion of the base about {a}" for a in "xyz"} | {"noise of the gyro"}


@pytest.mark.long
def test_acceleration_turns_an_unbalanced_line_of_sight(tmp_path) -> None:
    """No mode: line of sight = u a / (s (J s + c) (1 + L)), u = 0.002 kg.m along y, a along z of 0.5 m2/s4/Hz."""
    file = tmp_path / "shaken.csv"
    file.write_text("frequency [Hz],acceleration_z [m2/s4/Hz]\n2,0.5\n80,0.5\n")
    unbalance = {"platform.unbalance[2,2]": 0.002}
    plant, sight, G, _ = models("pitch", bending=0.0, psd=str(file), **unbalance)
    s, use = 2j * np.pi * F, (F >= 2.0) & (F <= 80.0)
    way = 0.002 / (s * (0.05 * s + 0.01) * (1.0 + plant.response(F) * G))
    by_hand = math.sqrt(np.trapezoid(np.abs(way[use]) ** 2 * 0.5, F[use]))
    assert sight.at(F).sources(G)["acceleration by unbalance"] == pytest.approx(by_hand, rel=0.02, abs=0.0)


@pytest.mark.long
def test_a_line_of_the_base_that_is_narrower_than_the_grid(tmp_path) -> None:
    """A peak at 41.3 Hz, 1e4 high and 0.2 % wide at its foot: its way there times the root of what it has.

    Each side is a (f/f1)^p with p = +-ln 1e4/ln 1.001, about 1 f0/(1000 ln 1e4) in height times width: 2 x 41.3/9215.
    """
    f0 = 41.3
    rows = [(1, 1e-4), (f0 / 1.001, 1e-4), (f0, 1.0), (f0 * 1.001, 1e-4), (100, 1e-4)]
    file = tmp_path / "line.csv"
    file.write_text("frequency [Hz],rate_x [rad2/s2/Hz]\n" + "".join(f"{f},{1e-4 * x}\n" for f, x in rows))
    _, sight, G, _ = models("pitch", bending=0.0, psd=str(file))
    use = F >= 39.0
    every = np.flatnonzero(use)[::8]  # from 39 Hz on, 2.7 % apart
    ways = sight.at(F[every])
    held = np.interp(ways.f, F, G)
    way = ways.moved[0].sight + ways.driven * held / (1.0 - held * ways.back) * ways.moved[0].seen
    at = int(np.argmin(np.abs(ways.f - f0)))
    line = abs(way[at]) ** 2 * 1e-4 * 2.0 * f0 / 9215.0 / (2.0 * np.pi * f0) ** 2
    flat = np.trapezoid(np.abs(way) ** 2 * 1e-8 / (2.0 * np.pi * ways.f) ** 2 * (ways.f < 100.0), ways.f)
    made = ways.sources(G[every])["motion of the base about x"] ** 2
    assert made / (line + flat) == pytest.approx(1.0, rel=0.02)


@pytest.mark.long
def test_slipping_friction_is_viscous_friction_of_the_same_torque() -> None:
    """M over the rms of the base's rate; joints that stick stay as they are."""
    system = gimbal(stiction=0.05)
    v = system.spectrum().rms("rate", 0)
    _, _, _, q = models("pitch", stiction=0.05)
    sources = system.line_of_sight(q)
    assert sources.slipping["platform.viscous"][0] == pytest.approx(0.01 + 0.04 / v, rel=2e-3)
    assert sources.free["platform.stiction"] == [0.0, 0.0]
    still = system.line_of_sight({**q, "platform.presliding": 0.5})
    assert still.slipping == {} and still.free == {}


@pytest.mark.long
def test_margins_hold_for_joints_that_stick_and_that_slip() -> None:
    """A rigid gimbal by hand: 0.4/(J s + c) while it slips, a contact of k = 0.05/2e-4 N.m/rad with damping sqrt(k J)
    beside it while it sticks; 1.5 steps of delay.  Tuned for the contact alone it was unstable as soon as it slipped.
    """
    wishes = ["phase margin=40deg", "peak S<6dB", "bandwidth>1.5Hz"]
    found = tune(gimbal(stiction=0.05, bending=0.0), wishes, structure="pi+lead", loop="pitch")
    assert found.had, str(found)
    s = 2j * np.pi * F
    x = s / (200 * np.pi)
    G = np.polyval(found.controller.num[::-1], s) / np.polyval(found.controller.den[::-1], s)
    way = 0.4 * G * np.exp(-1.5 * 2e-4 * s) / (1.0 + math.sqrt(2.0) * x + x**2)
    k = 0.05 / 2e-4
    slips, sticks = way / (0.05 * s + 0.01), way / (0.05 * s + 0.01 + math.sqrt(k * 0.05) + k / s)
    peaks = [float(np.abs(1.0 / (1.0 + L)).max()) for L in (slips, sticks)]
    worst = next(w.worst for w in found.wishes if w.wish.name == "peak S")
    assert max(peaks) == pytest.approx(worst, rel=0.02)
    for L in (slips, sticks):
        crossed = np.flatnonzero(np.diff(np.sign(np.abs(L) - 1.0)))
        assert np.all(np.abs(np.angle(-L[crossed])) > math.radians(39.0))
    assert "for joints that stick" in str(found)


def test_a_loop_slower_than_its_jitter_says_so() -> None:
    """L = f0/(j f) crosses at f0; the jitter counts from 1 Hz on."""
    f = np.geomspace(0.01, 100.0, 500)
    jitter = Wish("jitter", 25e-6, "rad", False, f=1.0)
    bandwidth = Wish("bandwidth", 2.0, "Hz", True)
    assert "crosses at 0.37 Hz" in slower([jitter], f, 0.37 / (1j * f))[0]
    assert slower([jitter], f, 5.0 / (1j * f)) == [] == slower([jitter, bandwidth], f, 0.37 / (1j * f))


@pytest.mark.long
def test_wanted_jitter_is_had_and_measured() -> None:
    wishes = ["phase margin=40deg", "gain margin=6dB", "jitter=20urad"]
    found = tune(gimbal(jitter_from=2.0, ride=60.0), wishes, structure="pi+notch", loop="pitch")
    assert found.proven, str(found)
    assert {w.wish.name for w in found.proofs[0].wishes} == {"phase margin", "gain margin", "jitter"}
    jitter = next(w for w in found.proofs[0].wishes if w.wish.name == "jitter")
    assert jitter.value == pytest.approx(jitter.expected, abs=jitter.U + 0.05 * jitter.expected)
    assert "µrad" in str(found) and found.command.count("--set") == 4 and "loop pitch" in str(found)


@pytest.mark.long
def test_a_jitter_that_friction_forbids_says_so() -> None:
    """Much less than the loop can do: the sources are named, the note says how friction was taken."""
    wishes = ["phase margin=40deg", "jitter=20urad"]
    found = tune(gimbal(stiction=0.05, jitter_from=2.0, ride=20.0), wishes, structure="pi+notch", loop="yaw")
    assert not found.had and not found.proven
    text = str(found)
    assert "cannot be had" in text and "the jitter is of motion of the base about z" in text
    assert "dry friction slips in the ride" in text


@pytest.mark.long
def test_a_controller_of_less_order_takes_the_design_away() -> None:
    """The design of the system has a notch: its coefficients beyond those of a pi controller become 0."""
    found = tune(gimbal(), ["phase margin=40deg", "S at 1Hz<-20dB"], structure="pi", loop="yaw")
    assert len(found.settings["yaw.num"]) == 4 and found.settings["yaw.num"][2:] == [0.0, 0.0]


TRACKED = {"bending": 0.0, "psd": "none", "target": "sine", "frequency": 3.0, "jitter_from": 1.0, "ride": 36.0}


@pytest.mark.long
def test_jitter_of_a_tracking_error_by_hand() -> None:
    """A sine of 0.5 mrad about yaw at 3 Hz, noise of gyro and images; continuous, the step of 0.2 ms: 2 %.

    With T_r the closed rate loop, H = exp(-17 ms s) sinc sinc of the images and L = C T_r H / s:  error = target S,
    S = 1/(1 + L);  images C T_r/s S;  gyro F T_r/s S, F its low pass.  Both loops, each without its own
    controller, make the same of it.
    """
    made = {}
    for loop in ("yaw", "track yaw"):
        _, sight, G, q = models(loop, "gimbal_tracking", amplitude=5e-4, **TRACKED)
        made[loop] = sight.at(F).sources(G)
    assert made["yaw"] == pytest.approx(made["track yaw"], rel=1e-4)
    s = 2j * np.pi * F
    low_pass = 1.0 / (1.0 + math.sqrt(2.0) * s / (200 * np.pi) + (s / (200 * np.pi)) ** 2)
    num, den = (np.polynomial.polynomial.polyval(s, np.array(q[f"yaw.{n}"])) for n in ("num", "den"))
    torque = num / den * 0.4 / (0.08 * s + 0.01)  # rate for a rate signal: k_t/R = 0.4 N.m/V, 0.08 kg.m2
    T_r = torque / (1.0 + torque * low_pass)
    images = np.exp(-0.017 * s) * np.sinc(0.01 * F) * np.sinc(0.004 * F)
    C = q["track_yaw.K"] * (1.0 + q["track_yaw.integral"] / s)
    S = 1.0 / (1.0 + C * T_r * images / s)
    use = F >= 1.0

    def rms(way: np.ndarray, density: np.ndarray | float) -> float:
        return math.sqrt(np.trapezoid((np.abs(way) ** 2 * density)[use], F[use]))

    got = made["yaw"]
    assert got["motion of the target"] == pytest.approx(5e-4 / math.sqrt(2.0) * abs(np.interp(3.0, F, S)), rel=0.02)
    assert got["noise of the gyro"] == pytest.approx(rms(low_pass * T_r / s * S, math.radians(0.005) ** 2), rel=0.02)
    held = 2.0 * 0.01 * 4e-10 * np.sinc(0.01 * F) ** 2
    assert got["noise of the images"] == pytest.approx(rms(C * T_r / s * S, held), rel=0.02)
    assert got["resolution of the images"] == pytest.approx(got["noise of the images"] / math.sqrt(12.0), rel=1e-6)


def test_a_resonance_between_the_frequencies_of_the_grid() -> None:
    """P = (w/s)2 (1 + 2 z s/w) closes with a damping of 0.005, as narrow as half an interval of the grid."""
    f0, z = 37.1, 0.005
    f = np.geomspace(1.0, 1000.0, 400)
    fine = finer(f)
    s = 2j * np.pi * fine
    w = 2.0 * np.pi * f0
    plant = (w / s) ** 2 * (1.0 + 2.0 * z * s / w)
    moved = (MovedSight("noise", 0.0 * s, 1.0 + 0.0 * s, np.ones(fine.size)),)
    ways = SightWays(f, fine, moved, plant, -plant)
    x = np.linspace(1.0, 1000.0, 4_000_001) / f0
    exact = np.trapezoid((1.0 + (2 * z * x) ** 2) / ((1.0 - x**2) ** 2 + (2 * z * x) ** 2), x * f0)
    assert ways.sources(np.ones(f.size, complex))["noise"] ** 2 == pytest.approx(exact, rel=0.02)


@pytest.mark.long
@pytest.mark.parametrize("loop", ["pitch", "track yaw"])
def test_jitter_of_a_tracking_gimbal_is_had_and_measured(loop: str) -> None:
    wishes = ["phase margin=40deg", "jitter=60urad", *(["bandwidth>0.6Hz"] if loop != "pitch" else [])]
    plain = gimbal("gimbal_tracking", jitter_from=2.0, ride=20.0, target_yaw=2e-3)
    found = tune(plain, wishes, structure="pi", loop=loop)
    jitter = next(w for w in found.proofs[0].wishes if w.wish.name == "jitter")
    assert found.proven, str(found)
    assert jitter.value == pytest.approx(jitter.expected, abs=jitter.U + 0.1 * jitter.expected)


def test_jitter_alone_is_no_wish_for_a_tracking_loop() -> None:
    with pytest.raises(UsageError, match="it is least with a loop track yaw that does nothing"):
        tune(gimbal("gimbal_tracking"), ["phase margin=40deg", "jitter=60urad"], loop="track yaw")


@pytest.mark.long
def test_over_a_wide_spread_the_best_of_the_nominal_plant_leads_to_a_better_island() -> None:
    """J +-30 % and mode +-10 %.  With notches of a damping to 2 (now 5) a global search of scipy, 30,000 controllers of
    all corners from four seeds, reached 0.752, 0.743, 0.572 and 0.549 of what is wanted; what evolves over the corners
    alone stayed at 0.47 and said that the jitter could not be had by itself, while that search had 65 urad.
    """
    over = ["platform.I_inner[1,1]=±30%", "platform.bending[1]=±10%"]
    system = gimbal(stiction=0.05, bending=42.0, gyro_noise=math.radians(0.005), gyro_bandwidth=100.0, psd="vehicle")
    wishes = ["phase margin=40deg", "gain margin=6dB", "jitter=100urad"]
    tuned = tune(system, wishes, over, "lead-lag+notch+rolloff", loop="pitch")
    assert not tuned.had and tuned.best > 0.8
    text = next(r for r in tuned.reasons if r.startswith("jitter alone: "))
    assert float(text.split()[2]) < 70.0 and text.endswith("µrad was found")
