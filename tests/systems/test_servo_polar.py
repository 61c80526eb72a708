"""The polar servo test, dynamic co-simulation of gyro, servo, table and encoder on shortened days: recovery, routes,
composite drift, table effects as predicted, refusals, a laboratory's file.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from reducing import with_options as reduced
from servoing import DAY50, DAY500, DPH, NAMES, QUIET, W50, errors, expected_rate, gyro, held, latitude, polar_at_2_ms
from stated import FAINT
from undiagnosed import reduce_undiagnosed

from gyrobench import frames
from gyrobench.engine.run_errors import RunError
from gyrobench.engine.session import Session, run
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.system.parameters import resolve
from gyrobench.system.system import InvalidConfigurationError, load_system
from gyrobench.system.values import InvalidValueError

NAME = "servo_polar"
LIMIT = 1e-6  # deg/h per g^n
ARCSEC = math.pi / 648000.0


@pytest.fixture(scope="module")
def polar() -> Iterator[Session]:
    with Session(polar_at_2_ms()) as prepared:  # a soft servo and a fast table below want 1 ms
        yield prepared


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.long
def test_random_gyros_at_random_latitudes(polar: Session, seed: int) -> None:
    """Every window reads what the equation says; every coefficient comes back to 1e-6 deg/h, by both ways."""
    rng = np.random.default_rng(seed)
    # J/H alpha_O goes with the Earth rate, here fifty times too large: a tenth of the float inertia
    values = {**DAY50, **QUIET, **gyro(rng), "latitude": latitude(rng), "gyro.J": 2e-5}
    record = polar.run(values)
    windows, _ = held(record)
    result = load_system(NAME).reduce(record)
    found = errors(result, values)
    assert set(found) == set(NAMES) and result.rank == 9
    for c in result.coefficients:
        assert abs(found[c.name]) < LIMIT, c.name
        assert c.truth == pytest.approx(values[f"gyro.{c.name}"] / DPH, rel=1e-12)
        if c.name not in ("D_F", "D_II"):  # those rest on the dwells, which Hu 1981 takes as at angle 0
            assert c.closed == pytest.approx(c.estimate, abs=LIMIT), c.name
    # the dwells turned by theta' T; the closed R carries the mean of D_S Z and D_O Y at half that
    turned = float(np.max(np.abs(windows.angle_end[:2])))
    assert abs(next(c for c in result.coefficients if c.name == "D_F").closed - values["gyro.D_F"] / DPH) < 2 * turned
    book = next(t for t in result.tables if t.title == "Notation of Hu 1981")
    R = next(row for row in book.rows if row[0] == "R")
    assert R[1] == pytest.approx(-values["gyro.D_F"] / DPH, abs=LIMIT)  # R = -D_F


@pytest.fixture(scope="module")
def day(polar: Session) -> Any:
    """A noiseless day of the standard gyro at 45.75 degrees."""
    return polar.run({**DAY50, **QUIET})


def test_every_window_reads_what_the_equation_says(day: Any) -> None:
    """Rates of all windows to 1e-6 deg/h, with J/H alpha_O, 5e-6 deg/h in the dwells at fifty Earth rates."""
    windows, _ = held(day)
    off = (windows.rate - expected_rate(day)) / DPH
    assert np.max(np.abs(off)) < 1e-6


def test_combination_when_nothing_tells_r_from_k_zx(day: Any) -> None:
    """Without the dwells only R + K_zx g2 sin2(latitude) is there, and is called so; the rest is unharmed."""
    result = reduced(day, route="combination")
    first = result.coefficients[0]
    assert first.name == "D_F + γ² sin²φ D_II" and "D_II" not in [c.name for c in result.coefficients]
    g = frames.normal_gravity(math.radians(45.75)) / frames.G0
    truth = -0.3 - 0.05 * (g * math.sin(math.radians(45.75))) ** 2
    assert first.truth == pytest.approx(truth, rel=1e-9) and first.estimate == pytest.approx(truth, abs=LIMIT)
    assert any("only as R + γ² sin²φ K_zx" in w for w in result.warnings)
    for c in result.coefficients[1:]:
        assert c.estimate == pytest.approx(c.truth, abs=LIMIT)


@pytest.mark.long
def test_equal_compliances_assumed(polar: Session) -> None:
    """Route (i) is exact when K_zx = K_xz; else the error is (K_zx - K_xz) in K_zx and that times g2 sin2 in R."""
    values = {**DAY50, **QUIET, "route": "equal", "gyro.D_II": -0.04 * DPH, "gyro.D_SS": 0.04 * DPH}
    record = polar.run(values)
    assert len(held(record)[0].rate) == 2 * 143 or len(held(record)[0].rate) > 280  # no dwells
    result = load_system(NAME).reduce(record)
    for c in result.coefficients:
        assert c.estimate == pytest.approx(c.truth, abs=LIMIT), c.name
        assert c.closed == pytest.approx(c.truth, abs=LIMIT), c.name
    biased = load_system(NAME).reduce(polar.run({**values, "gyro.D_II": -0.05 * DPH}))
    off = {c.name: c.estimate - c.truth for c in biased.coefficients}
    s = math.sin(math.radians(45.75))
    g = frames.normal_gravity(math.radians(45.75)) / frames.G0
    assert off["D_II"] == pytest.approx(0.01, abs=LIMIT)  # -K_xz for -K_zx
    assert off["D_F"] == pytest.approx(-0.01 * (g * s) ** 2, abs=LIMIT)
    assert any("assuming K_zx = K_xz" in w for w in biased.warnings)


def test_one_mount_tells_combinations(day: Any) -> None:
    """X = +g s in S and -g s in N all day: five numbers each, called by what they hold; checked against the truth."""
    g, s = frames.normal_gravity(math.radians(45.75)) / frames.G0, math.sin(math.radians(45.75))
    for m, sign in (("S", "+"), ("N", "−")):
        plan = [r for r in day.run.plan if r.label.startswith(f"polar {m}")]
        keep = np.isin(day.windows["phase"], [r.phase for r in plan])
        part = type(day)({k: v[keep] for k, v in day.windows.items()}, {}, day.run.replace(plan=plan))
        result = load_system(NAME).reduce(part)
        names = [c.name for c in result.coefficients]
        assert names[0] == f"D_F {sign} γ sinφ D_I + γ² sin²φ D_II" and len(names) == 5
        assert result.coefficients[0].truth == pytest.approx(
            -0.3 - float(f"{'-' if m == 'N' else ''}0.9") * g * s - 0.05 * (g * s) ** 2
        )
        for c in result.coefficients:
            assert c.estimate == pytest.approx(c.truth, abs=LIMIT), c.name
        assert any(f"One mount (polar {m})" in w for w in result.warnings)


def test_dwells_that_are_missing_are_asked_for(day: Any) -> None:
    plan = [r for r in day.run.plan if "east" not in r.label]
    keep = np.isin(day.windows["phase"], [r.phase for r in plan])
    part = type(day)({k: v[keep] for k, v in day.windows.items()}, {}, day.run.replace(plan=plan))
    with pytest.raises(ReductionError, match="R and K_zx both asked for"):
        load_system(NAME).reduce(part)


def part_of(record: Any, degrees: float) -> Any:
    """The record with what each mount turned by up to ``degrees``."""
    w = record.windows
    keep = np.zeros(w["phase"].size, dtype=bool)
    for p in np.unique(w["phase"]):
        mine = w["phase"] == p
        keep |= mine & (np.abs(w["angle_end"] - w["angle_start"][mine][0]) < math.radians(degrees))
    return type(record)({k: v[keep] for k, v in w.items()}, {}, record.run)


@pytest.mark.parametrize("degrees", [340.0, 180.0, 120.0])
def test_part_of_a_turn_is_enough_for_least_squares(day: Any, degrees: float) -> None:
    """Rank and condition decide; the harmonics alone want a whole turn, and say so."""
    result = load_system(NAME).reduce(part_of(day, degrees))
    assert result.rank == 9
    for c in result.coefficients:
        assert c.closed is None and abs(c.estimate - c.truth) < 1e-6, c.name
    assert [h.n for h in result.harmonics if h.n < 3] == []
    assert any("harmonics want a whole turn; polar S turned by" in w for w in result.warnings)


def test_too_little_of_a_turn_is_refused(day: Any) -> None:
    with pytest.raises(
        ReductionError, match=r"condition number [\d.]+ above 1000[^-]*- the mounts turned by polar S 27"
    ):
        load_system(NAME).reduce(part_of(day, 30.0))


@pytest.mark.long
def test_large_unbalance(polar: Session) -> None:
    """D_S of a full Earth rate: within a window the rate changes by percents, and the regressors follow it (an even
    turn was 2e-3 deg/h off at D_S = 15 deg/h/g).  Drift and Earth rate are fifty times larger than in a real day.
    """
    values = {**DAY50, **QUIET, "gyro.J": 2e-7, "table.capture_rate": 200.0, "gyro.D_S": 50.0 * 15.0 * DPH}
    for c in load_system(NAME).reduce(polar.run(values, step=1e-3)).coefficients:
        assert abs(c.estimate - c.truth) / 50.0 < 2e-8, c.name


@pytest.mark.long
def test_length_of_the_plan_is_that_of_the_turn(polar: Session) -> None:
    """Each mount lasts as long as drift and Earth rate take for the travel, to a window; D_S = 10 deg/h/g makes that
    16 % more than 2 pi / W: mean of 1 / (1 - r cos theta) is 1 / sqrt(1 - r2), r = 10 0.698 / 15.04 = 0.46.
    """
    values = {**DAY50, **QUIET, "table.capture_rate": 200.0, "gyro.D_S": 500.0 * DPH}
    system = polar.system.with_values(values)
    resolve(polar.assembly, system, 1, polar.base)
    record = polar.run(values)
    t0, t1, phase = (record.windows[c] for c in ("t_start", "t_end", "phase"))
    for number, planned in enumerate(system.plan().phases, 1):
        if planned.travel > 0.0:
            assert planned.expected > 1.1 * DAY50["time"]
            assert t1[phase == number][-1] - t0[phase == number][0] == pytest.approx(planned.expected, abs=13.0)


@pytest.mark.parametrize(
    ("values", "text"),
    [
        # 378 deg at W - 1.0 deg/h (D_F, D_I gamma s, ...): 26.9 h
        (
            {"time": "4h"},
            r"polar S: to turn by 378° takes 9\d,\d{3} s .* not 14,400 s, and the whole plan 19\d,\d{3} s",
        ),
        # 30 deg/h/g * 0.698 = 20.9 deg/h against 15.04 + 1.0: the table stays where cos theta = -0.69, 133 deg
        ({"gyro.D_S": "30deg/h"}, r"polar S: never turns by 363°: after 133° the drift .* equal to the Earth rate"),
    ],
)
def test_length_or_standstill_is_foreseen(polar: Session, values: dict[str, Any], text: str) -> None:
    with pytest.raises(InvalidConfigurationError, match=text):
        polar.run(values)


def test_table_that_does_not_follow_is_refused(day: Any) -> None:
    windows = {**day.windows, "mean": np.full(day.windows["mean"].size, 10.0 * 3.0 * ARCSEC)}
    with pytest.raises(ReductionError, match="up to 3 arcsec away from the gyro"):
        load_system(NAME).reduce(type(day)(windows, {}, day.run))
    loose = day.run.replace(options={**day.run.options, "tracking": 0.0})
    load_system(NAME).reduce(type(day)(windows, {}, loose))


def test_saturated_pickoff_is_refused(day: Any) -> None:
    windows = {**day.windows, "flagged": day.windows["flagged"].copy()}
    windows["flagged"][-1] = 5
    with pytest.raises(ReductionError, match="flagged windows"):
        load_system(NAME).reduce(type(day)(windows, {}, day.run))


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"latitude": "5deg"}, r"latitude 5° \(10° to 80° .*condition 9\d\d, least determined: "),
        ({"latitude": "0deg"}, r"rank 4 of 8, not estimable: "),
        ({"latitude": "-85deg"}, r"latitude -85°"),
        ({"route": "guess"}, "one of dwells, equal, combination"),
        ({"mounts": "S E"}, "the mounts S and N"),
        ({"terms": 5}, "there are 4"),
        ({"window": 50000.0}, "too few windows"),
        ({"gyro.D_OO": 1e-7, "gyro.terms": 10}, "gyro.D_OO = .* cannot be told"),
        ({"table.index_rate": 0.1}, "index more slowly"),
        ({"gyro.mount[1,1]": 0.5}, "gyro.mount: rows are not orthonormal"),
    ],
)
def test_refused_before_anything_runs(polar: Session, values: dict[str, Any], text: str) -> None:
    with pytest.raises((InvalidConfigurationError, InvalidValueError), match=text):
        polar.run(values)


@pytest.mark.long
def test_encoder_harmonics_shift_as_predicted(polar: Session, day: Any) -> None:
    """a sin(theta + p) read with the angle adds a theta' cos(theta + p) to the rate; mount S turns at +W, N at -W.

    p = 0: +a W in B1S, -a W in B1N, so U_x by a W/(g c).  p = pi/2: -a W in A1S, +a W in A1N, so U_y by a W/(g c) and
    D_O by minus that.  Twice a turn the two mounts have opposite signs and cancel.
    """
    a = 20.0 * ARCSEC
    c, g = math.cos(math.radians(45.75)), frames.normal_gravity(math.radians(45.75)) / frames.G0
    plain = {k.name: k.estimate for k in reduced(day, route="combination").coefficients}
    size = a * W50 / (g * c) / DPH
    for phase, name, sign in ((0.0, "D_S", 1.0), (math.pi / 2.0, "D_O", -1.0)):
        values = {
            **DAY50,
            **QUIET,
            "table.encoder_amplitude[1]": a,
            "table.encoder_phase[1]": phase,
            "u_angle1": a * FAINT,
        }
        result = load_system(NAME).reduce(polar.run({**values, "route": "combination"}))
        shift = {k.name: k.estimate - plain[k.name] for k in result.coefficients}
        assert shift[name] == pytest.approx(sign * size, rel=0.02)
        assert max(abs(v) for n, v in shift.items() if n != name) < 0.02 * size
        source = f"angle error, once a turn ({'sine' if phase == 0.0 else 'cosine'})"
        line = next(b for b in result.budget if b.coefficient == name and b.source == source)
        assert line.sensitivity * a == pytest.approx(sign * size, rel=0.1)  # told before it is measured


@pytest.mark.long
def test_axis_tilt_shifts_as_predicted(polar: Session, day: Any) -> None:
    """Table axis tilted by t about y = west, alike in both mounts: its latitude is wrong by t, s becomes s + t c and c
    becomes c - t s.  So D_I takes D_I t c/s, D_S takes -D_S t s/c; and W (1 - t2/2) for W, W t2/(2 g s) in D_I, is seen
    at fifty Earth rates.  The budget lets each mount be set up by itself: 1/sqrt2 of the common shift in D_S.
    """
    t, phi = 20.0 * ARCSEC, math.radians(45.75)
    plain = {k.name: k.estimate for k in reduced(day, route="combination").coefficients}
    values = {**DAY50, **QUIET, "table.tilt[1]": t, "u_axis": t, "route": "combination"}
    result = load_system(NAME).reduce(polar.run(values))
    shift = {k.name: k.estimate - plain[k.name] for k in result.coefficients}
    size_I, size_S = 0.9 * t / math.tan(phi), 0.7 * t * math.tan(phi)
    square = W50 / DPH * t * t / 2.0 / math.sin(phi)
    assert abs(shift["D_S"]) == pytest.approx(size_S, rel=0.02)
    assert abs(shift["D_I"]) == pytest.approx(size_I, abs=1.1 * square)
    assert shift["D_I"] * shift["D_S"] < 0.0  # both are negative
    lines = [b for b in result.budget if b.coefficient == "D_S" and b.source.startswith("table axis about y (phase ")]
    assert len(lines) == 2
    assert sum(b.sensitivity for b in lines) * t == pytest.approx(shift["D_S"], rel=0.1)
    assert math.hypot(*(b.contribution for b in lines)) == pytest.approx(size_S / math.sqrt(2.0), rel=0.1)


@pytest.mark.long
def test_unbalance_over_stiffness_shifts_as_predicted(polar: Session, day: Any) -> None:
    """A mass m at r on the face pulls with m r (y force); the table gives way by that over K_T: a cos(theta) in S and
    -a cos(theta) in N with a = m r g c / K_T.  The rates -+a theta' sin(theta) are -a W sin(theta) in both mounts, and
    K_zy = -(A1S + A1N)/(g2 sin 2 phi) takes 2 a W/(g2 sin 2 phi).  [SERVO-TF: a static torque offsets the angle]
    """
    stiffness, unbalance, phi = 1.5e5, 0.5, math.radians(45.75)
    gravity = frames.normal_gravity(phi)
    g, at_1g = gravity / frames.G0, unbalance * frames.G0 / stiffness
    values = {**DAY50, **QUIET, "table.stiffness": stiffness, "table.unbalance[1]": unbalance, "u_unbalance": at_1g}
    record = polar.run({**values, "tracking": 0.0, "route": "combination"}, step=1e-3)
    result = load_system(NAME).reduce(record)
    plain = {k.name: k.estimate for k in reduced(day, route="combination").coefficients}
    shift = {k.name: k.estimate - plain[k.name] for k in result.coefficients}
    size = 2.0 * at_1g * g * math.cos(phi) * W50 / (g * g * math.sin(2.0 * phi)) / DPH
    assert abs(shift["D_IO"]) == pytest.approx(size, rel=0.02)
    assert max(abs(v) for n, v in shift.items() if n != "D_IO") < 0.01 * size
    source = "unbalance over stiffness (mass along y)"
    line = next(b for b in result.budget if b.coefficient == "D_IO" and b.source == source)
    assert line.sensitivity * at_1g == pytest.approx(shift["D_IO"], rel=0.1)
    with pytest.raises(ReductionError, match="away from the gyro"):
        reduced(record, tracking=load_system(NAME)["tracking"])


def test_composite_drift_and_turns(polar: Session) -> None:
    """Two turns of each mount, noise on: systematic and random part of each phase, turns alike."""
    values = {**DAY500, "turns": 2, "time": 100.0, "route": "combination", "gyro.markov": 0.0, "gyro.white": 1e-7}
    result = load_system(NAME).reduce(polar.run(values, seed=4, step=1e-3))
    table = next(t for t in result.tables if t.title == "Systematic and random drift rate")
    assert [row[0] for row in table.rows] == ["polar S", "polar N"] and "4.8 s" in table.caption
    truth = {c.name: c.truth for c in result.coefficients}
    g, phi = frames.normal_gravity(math.radians(45.75)) / frames.G0, math.radians(45.75)
    for row, sign in zip(table.rows, (1.0, -1.0), strict=True):
        mean = truth["D_F + γ² sin²φ D_II"] + sign * truth["D_I"] * g * math.sin(phi)
        mean += truth["D_SS"] * (g * math.cos(phi)) ** 2 / 2.0
        sigma = 1e-7 / math.sqrt(row[2]) / DPH
        assert row[3] == pytest.approx(mean, abs=5.0 * sigma / math.sqrt(row[1]) + 0.002)
        assert row[4] == pytest.approx(sigma, rel=0.25) and row[5] == row[2]
    assert next(t for t in result.tests if t.name == "turn to turn").p > 0.001
    less = next(t for t in result.tables if t.title == "Turns less the first turn")
    assert [row[:2] for row in less.rows] == [["polar S", 2], ["polar N", 2]]
    assert all(abs(row[3]) < 5.0 * row[4] / math.sqrt(row[2]) for row in less.rows)
    rho = next(t for t in result.tables if t.title == "Autocorrelation of the random drift rate").rows
    assert rho[0][1] == 1.0 and rho[-1][0] == table.rows[0][1] // 4


def test_dynamic_against_quasi_static(polar: Session) -> None:
    """A record made from the equation alone gives the coefficients of the co-simulation, noise on, within its u."""
    values = {**DAY500, "gyro.markov_tau": 1.0, "nuisances": "none"}  # what J/H leaves is judged, not explained
    noisy = polar.run(values, seed=6)
    windows, rows = held(noisy)
    angle_end = noisy.windows["angle_end"].copy()
    angle_end[rows] = windows.angle_start + expected_rate(noisy) * (windows.t_end - windows.t_start)
    static = load_system(NAME).reduce(type(noisy)({**noisy.windows, "angle_end": angle_end}, {}, noisy.run))
    for a, b in zip(static.coefficients, load_system(NAME).reduce(noisy).coefficients, strict=True):
        assert abs(a.estimate - b.estimate) < 4.0 * b.u and b.u > 1e-4, a.name
        assert a.estimate == pytest.approx(a.truth, abs=3e-5), a.name  # J/H at 500 Earth rates


@pytest.mark.long
def test_one_step_of_a_tenth_gives_the_same(polar: Session) -> None:
    """0.1 ms and 1 ms of communication step: the coefficients differ by less than 1e-7 deg/h."""
    values = {**DAY500, **QUIET, "time": 10.0, "dwell": 5.0, "window": 1.0, "route": "dwells"}
    part = {**values, "site.earth_rate": 100.0 * W50, "time": 17.3, "cage.i_max": 10.0}
    a, b = (expected_rate(r) - held(r)[0].rate for r in (polar.run(part, step=s) for s in (1e-3, 1e-4)))
    assert np.max(np.abs(a)) < 1e-4 * DPH and np.max(np.abs(b)) < 1e-4 * DPH


def test_laboratory_file(tmp_path: Any, day: Any) -> None:
    """The template, filled with the angles of a day in degrees, gives the same coefficients."""
    system = load_system(NAME)
    lines = system.measured_data.template.splitlines()
    header = lines.pop()
    windows, rows = held(day)
    phases = {label: k for k, label in enumerate(("x east, y up", "x east, y down", "polar S", "polar N"), 1)}
    labels = {r.phase: phases[r.label] for r in day.run.plan if r.mode == "servo"}
    number = [labels[p] for p in day.windows["phase"][rows].tolist()]
    deg = [[math.degrees(x) for x in v] for v in (windows.angle_start, windows.angle_end)]
    body = [
        f"{p},{a!r},{b!r},{c!r},{d!r}"
        for p, a, b, c, d in zip(number, windows.t_start.tolist(), windows.t_end.tolist(), *deg, strict=True)
    ]
    file = tmp_path / "day.csv"
    g = frames.normal_gravity(math.radians(45.75))
    text = "\n".join([*lines, header, *body, ""]).replace("9.8067m/s2", f"{g!r}m/s2")
    file.write_text(text, encoding="utf-8")
    record = system.read_measured(file, {"nuisances": "none"})  # as the record without noise
    record.run.parameters["site.earth_rate"] = W50
    for a, b in zip(reduce_undiagnosed(record).coefficients, load_system(NAME).reduce(day).coefficients, strict=True):
        assert a.estimate == pytest.approx(b.estimate, abs=1e-8) and a.truth is None
    file.write_text(text.replace("# phase 3 = polar S", "# phase 3 = polar E"), encoding="utf-8")
    with pytest.raises(Exception, match="phase 3: 'polar E' is no attitude"):
        system.read_measured(file, {"nuisances": "none"})  # as the record without noise


def test_delays(day: Any) -> None:
    """The loops are cut where the table holds."""
    assert day.run.delays == {
        "gyro.u -> table.u": 2e-3, "cage.i -> gyro.i": 2e-3, "table.angle_read -> sequencer.angle": 2e-3,
        "table.in_position -> sequencer.in_position": 2e-3,
    }  # fmt: skip


@pytest.mark.long
def test_stopped_and_continued(tmp_path: Any) -> None:
    """Stopped while the gyro holds the table, noise and quantum on, and continued: the record is bit-equal."""
    values = {**DAY500, "route": "combination", "mounts": "N", "table.quantum": 0.02 * ARCSEC}
    whole = run(NAME, values=values, seed=3)
    with pytest.raises(RunError, match="--resume"):
        run(NAME, values=values, seed=3, out=tmp_path / "day", stop_at=90.0)
    again = run(NAME, values=values, seed=3, out=tmp_path / "day", resume=True)
    assert again.same_data(whole) and again.run.resumed_at == pytest.approx([90.0], abs=2e-3)


def test_noise_coefficients_of_the_residuals(day: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """A long test has their table, from its residuals and said so; this day is too short for it."""
    from gyrobench.reduction.series import noise_coefficients_table as module

    def tables() -> list[dict[str, Any]]:
        return [t for t in load_system(NAME).reduce(day).tables if t.title == "Noise coefficients"]

    assert len(day.windows["t_start"]) < module.LEAST and tables() == []
    monkeypatch.setattr(module, "LEAST", 64)
    (table,) = tables()
    assert module.RESIDUAL in table.caption and [row[0][0] for row in table.rows] == list("NBKQ")
