"""The two-axis servo test, dynamic co-simulation of gyro, two servo tables and encoders on shortened days: recovery,
what the stiffness of the loop leaves, table effects as predicted, fidelity, refusals, a laboratory's file.  Coverage
is counted in test_coverage.py.
"""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest
from servoing_two_axes import (
    BOTH,
    DPH,
    NAME,
    NAMES,
    QUIET,
    day,
    errors,
    geometry,
    gyro,
    held,
    left,
    reduced,
    refusals,
    stiffness_effect,
)
from stated import FAINT
from undiagnosed import reduce_undiagnosed

from gyrobench import drift, frames
from gyrobench.engine.run_errors import RunError
from gyrobench.engine.session import Session, run
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.system.system import InvalidConfigurationError, load_system
from gyrobench.system.values import InvalidValueError

ARCSEC = math.pi / 648000.0
PHI = math.radians(45.75)
NOISY = day(500.0, **{"gyro.markov_tau": 1.0, "outer.quantum": 0.01 * ARCSEC, "inner.quantum": 0.01 * ARCSEC})


# ------------------------------------------------------------------------------------------ recovery
@pytest.mark.parametrize("seed", range(2))
@pytest.mark.long
def test_random_gyros_at_random_latitudes(session: Session, seed: int) -> None:
    """A day in fifty: every window reads the equation of Hu 1981 and the effect of the loop's stiffness, to 2e-8 deg/h.
    Every coefficient comes back to 1e-6 deg/h of the truth and what that effect makes of it, by both ways; the effect
    goes with the cube of the Earth rate, so that nothing is left of it in a whole day.
    """
    rng = np.random.default_rng(seed)
    latitude = float(math.radians(rng.uniform(15.0, 75.0)) * rng.choice([-1.0, 1.0]))
    _, a, b = refusals.best_pairs(latitude, 86400.0, 9, frames.EARTH_RATE)[int(rng.integers(3))]
    values = {**day(50.0, 432), **QUIET, **gyro(rng), "latitude": latitude, "mounts": f"{a} {b}"}
    record = session.run(values)
    effect = stiffness_effect(record)
    assert np.max(np.abs(left(record) - effect)) < 2e-8 * DPH
    seen, site, _ = held(record)
    result = load_system(NAME).reduce(record)
    found = errors(result, values)
    assert set(found) == {*NAMES["x"], *NAMES["y"]} and result.rank == 18
    for j, c in enumerate("xy"):
        shift = np.linalg.lstsq(seen.design(site, NAMES[c]), effect[:, j], rcond=None)[0] / DPH
        for name, expected in zip(NAMES[c], shift, strict=True):
            assert abs(found[name]) < 3e-6 and abs(found[name] - expected) < 1e-6, name
    for q in result.coefficients:
        assert q.closed == pytest.approx(q.estimate, abs=1e-6), q.name
        assert q.truth == pytest.approx(values[f"gyro.{q.name}"] / DPH, rel=1e-12)


@pytest.fixture(scope="module")
def quiet(session: Session) -> Any:
    """A noiseless day of the standard gyro at 45.75 degrees, two hundred times as fast."""
    return session.run({**day(200.0), **QUIET})


@pytest.mark.long
def test_stiffness_is_what_is_left(session: Session, quiet: Any) -> None:
    """Two hundred times as fast 1e-5 deg/h are left, as predicted to 2 %; twice as stiff (crossover up by 1.41) leaves
    half of it."""
    found, expected = left(quiet), stiffness_effect(quiet)
    for j, size in ((0, 1.1e-5), (1, 4.2e-6)):
        assert np.max(np.abs(found[:, j])) == pytest.approx(size * DPH, rel=0.1)
        assert np.max(np.abs(found - expected)[:, j]) < 0.05 * size * DPH
    soft = session.run({**day(200.0), **QUIET, "outer.crossover": 100.0 * math.pi / math.sqrt(2.0)})
    ratio = np.max(np.abs(left(soft)[:, 0])) / np.max(np.abs(found[:, 0]))
    assert ratio == pytest.approx(2.0, rel=0.03)  # K_T goes with the square of the crossover, but for the lag


def test_inner_axis_is_where_the_formula_says(quiet: Any) -> None:
    """The largest inner angles of mounts 2 and 4 are those of SERVO2-LOCK but for the drift; the report has both."""
    rows = next(t for t in load_system(NAME).reduce(quiet).tables if t.title == "Mounts").rows
    for row in rows:
        assert row[5] == pytest.approx(45.75, abs=0.1) and row[6] == pytest.approx(45.75, abs=0.01)
    assert rows[1][4] == pytest.approx(-360.0, abs=4.0)  # X = N goes round once


# ------------------------------------------------------------------------------------------ table effects
def predicted(result: Any, source: str, row: int | None = None) -> np.ndarray[Any, Any]:
    """(18,) changes of the coefficients over FAINT, from the budget that both channels share: of its m independent
    errors the one of ``row``, or all at once.
    """
    parts = [np.array(b.changes) for b in result.type_b if b.source.startswith(source)]
    assert parts
    return np.array(sum(p.sum(axis=0) if row is None else p[row] for p in parts)) / FAINT


SIZE = 20.0 * ARCSEC
STATED = ("u_angle1", "u_angle2", "u_axis", "u_square", "u_wobble", "u_mount")


@pytest.fixture(scope="module")
def brief(session: Session) -> tuple[np.ndarray[Any, Any], Any]:
    """The same, five hundred times as fast: estimates, and the result with all errors stated."""
    record = session.run({**day(500.0), **QUIET})
    plain = np.array([c.estimate for c in load_system(NAME).reduce(record).coefficients])
    return plain, reduced(record, **dict.fromkeys(STATED, SIZE * FAINT))


def shifted(session: Session, brief: Any, **values: Any) -> np.ndarray[Any, Any]:
    """(18,) what values change of the estimates of brief."""
    record = session.run({**day(500.0), **QUIET, **values})
    return np.array([c.estimate for c in reduced(record).coefficients]) - brief[0]


@pytest.mark.parametrize(
    ("setting", "source", "row"),
    [
        # a sin(x) read with the outer, a cos(2 y) with the inner angle: rows are sine, cosine
        ({"outer.encoder_amplitude[1]": 1.0}, "outer angle error, once", 0),
        ({"inner.encoder_amplitude[2]": 1.0, "inner.encoder_phase[2]": math.pi / 2}, "inner angle error, twice", 1),
        # the outer axis tilted about its table's second axis Z, the same in both mounts: rows are mounts
        ({"outer.tilt[2]": 1.0}, "table set up, about Z", None),
        # the inner axis tilted about its table's first axis Z, out of the right angle with X
        ({"inner.tilt[1]": 1.0}, "right angle", 0),
        ({"wobble_x.amplitude": 1.0}, "wobble of the outer", 0),
        ({"wobble_y.amplitude": 1.0, "wobble_y.phase": math.pi / 2}, "wobble of the inner", 1),
    ],
)
@pytest.mark.long
def test_table_effects_as_predicted(
    session: Session, brief: Any, setting: dict[str, float], source: str, row: Any
) -> None:
    """An error of 20 arcsec shifts the coefficients as the budget says before the run, with sign, to 3 % of the largest
    shift (five hundred Earth rates make the shifts large)."""
    expected = predicted(brief[1], source, row)
    shift = shifted(session, brief, **{n: v * (SIZE if "phase" not in n else 1.0) for n, v in setting.items()})
    assert np.max(np.abs(expected)) > 1e-3
    assert np.max(np.abs(shift - expected)) < 0.03 * np.max(np.abs(expected))


@pytest.mark.long
def test_gyro_askew_on_the_plate_as_predicted(session: Session, brief: Any) -> None:
    """The gyro turned by 20 arcsec about each axis of the plate; about z it mixes the channels of the loops."""
    for k, axis in enumerate("xyz"):
        M = frames.rotation(np.eye(3)[k], SIZE).T  # rows: the gyro's axes
        values = {f"gyro.mount[{i + 1},{j + 1}]": float(M[i, j]) for i in range(3) for j in range(3)}
        shift = shifted(session, brief, **values)
        expected = predicted(brief[1], f"gyro on the plate, about {axis}")
        assert np.max(np.abs(shift - expected)) < 0.03 * np.max(np.abs(expected)), axis


# ------------------------------------------------------------------------------------------ noise
@pytest.mark.long
def test_dynamic_against_quasi_static(session: Session) -> None:
    """Angles integrated from the equation alone give the coefficients of the co-simulation, noise on, within its u."""
    noisy = session.run(NOISY, seed=6)
    _, site, rows = held(noisy)
    p = noisy.run.parameters
    true = {c: np.array([p[f"gyro.{n}"] for n in NAMES[c]]) for c in "xy"}
    static = {k: np.array(v) for k, v in noisy.windows.items()}

    def rates(at: Any) -> tuple[float, float]:
        wx, wy = (float(drift.regressors(site.g * np.array(at), NAMES[c]) @ true[c]) for c in "xy")
        return wx, wy

    for phase, mount in ((2, 2), (4, 4)):
        k = np.flatnonzero((static["phase"] == phase) & rows)
        time = static["t_end"][k[-1]] - static["t_start"][k[0]]
        _, x, y = geometry.path(mount, PHI, time, 16 * k.size + 1, site.earth_rate, rates)
        for axis, a in (("outer", x), ("inner", y)):
            static[f"{axis}_start"][k], static[f"{axis}_end"][k] = a[:-1:16], a[16::16]
    ideal = load_system(NAME).reduce(type(noisy)(static, {}, noisy.run))
    for a, b in zip(ideal.coefficients, load_system(NAME).reduce(noisy).coefficients, strict=True):
        assert abs(a.estimate - b.estimate) < 4.0 * b.u and b.u > 1e-4, a.name
        assert a.estimate == pytest.approx(a.truth, abs=1e-4), a.name


# ------------------------------------------------------------------------------------------ refusals
@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"mounts": "5"}, r"mount 5: gimbal lock: .* reaches 90° .*best pairs here: 2 4 \(condition 25"),
        ({"mounts": "2 12"}, "mount 12: gimbal lock"),
        ({"mounts": "9 12"}, "mount 12: gimbal lock: .*are left: x channel, rank 5 of 9, not estimable: .*Dx_x"),
        ({"mounts": "3 4", "latitude": "45deg"}, "mount 3: gimbal lock: .* reaches 90°"),
        ({"mounts": "8 4", "latitude": "-45deg"}, "mount 8: gimbal lock: .* reaches 90°"),
        ({"mounts": "9 10"}, r"mounts 9 10 .*: x channel, rank 5 of 9, not estimable: .*Dx_xz \+ 0\.7163 Dx_z"),
        ({"mounts": "6"}, "mount 6 .* rank 1 of 9"),
        ({"mounts": "2 4", "latitude": "5deg"}, r"condition 4\.\d+e\+03, 1000 is allowed; least determined: "),
        ({"time": "1h", "window": 60.0}, "for 1 h: condition .* no pair of mounts does"),
        ({"mounts": "2 13"}, "numbers 1 to 12"),
        ({"mounts": ""}, "numbers 1 to 12"),
        ({"window": 50000.0}, "too few windows"),
        ({"terms": 5}, "terms = 5: must be >= 8"),
        ({"gyro.Dx_yy": 1e-8, "gyro.terms_x": 10}, r"gyro\.Dx_yy = .* cannot be told from"),
        ({"gyro.Dy_0": "4deg/h"}, "mount 4: gimbal lock: the drift of this gyro brings"),
        ({"gyro.mount": [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]}, "the x pickoff drives the outer axis"),
        ({"gyro.mount[1,1]": 0.5}, "gyro.mount: rows are not orthonormal"),
        ({"outer.base[1,1]": 0.5}, "outer.base: rows are not orthonormal"),
        ({"inner.index_rate": 0.1}, r"inner\.index_rate = 0\.1 rad/s: .* index more slowly"),
        ({"inner.polarity": -1}, "inner.polarity = -1"),
    ],
)
def test_refused_before_anything_runs(session: Session, values: dict[str, Any], text: str) -> None:
    with pytest.raises((InvalidConfigurationError, InvalidValueError), match=text):
        session.run(values)


def test_single_mount_is_warned_of() -> None:
    """[SERVO2-RANK] A single mount with all terms is warned of, with its condition (1.65e3) and better pairs."""
    system = load_system(NAME)
    system.set("mounts", "2")
    assert system.check() == []
    (text,) = system.warnings()
    assert re.match(r"Mount 2: condition 1\.65e\+03, least determined: Dx_.*best pairs here: 2 4", text)
    system.set("mounts", "2 4")
    assert system.warnings() == []


def test_run_ends_before_gimbal_lock(session: Session) -> None:
    """The stop of the part: mount 2 goes to 45.75 degrees, cosine 0.698."""
    with pytest.raises(RunError, match=r"gimbal lock: inner angle -?0\.6"):
        session.run({**day(500.0), **QUIET, "coupling.least": 0.8})


def test_brushes_are_overcome(session: Session) -> None:
    """Friction of 1400 g.cm on both axes, the base turning: capture comes near enough to null, M / (J w2) = 4.4 arcsec,
    and the fine loop then holds it to M / K_T, 0.09 arcsec, far within the 2 arcsec of Hu 1981.
    """
    brushes = {f"{slot}.friction": 0.137 for slot in BOTH}
    w = session.run({**day(500.0), **QUIET, **brushes}).windows
    servo = np.isin(w["phase"], [2, 4])
    for a in "xy":
        assert np.max(np.abs(w[f"mean_{a}"][servo])) / 10.0 < 0.15 * ARCSEC


def test_refused_records(quiet: Any) -> None:
    w = quiet.windows
    loose = {**w, "mean_x": np.full(w["mean_x"].size, 10.0 * 3.0 * ARCSEC)}
    with pytest.raises(ReductionError, match="x axis: the table is up to 3 arcsec away from the gyro"):
        load_system(NAME).reduce(type(quiet)(loose, {}, quiet.run))
    meta = quiet.run.replace(options={**quiet.run.options, "tracking": 0.0})
    load_system(NAME).reduce(type(quiet)(loose, {}, meta))
    flagged = {**w, "flagged": np.where(np.arange(w["flagged"].size) == 7, 3, 0)}
    with pytest.raises(ReductionError, match="flagged windows"):
        load_system(NAME).reduce(type(quiet)(flagged, {}, quiet.run))


def test_eight_terms_say_what_they_leave_out(quiet: Any) -> None:
    result = reduced(quiet, terms=8)
    assert len(result.coefficients) == 16
    assert any("Dx_y is simulated but not in the 8-term model" in text for text in result.warnings)
    assert any("Dy_x is simulated" in text for text in result.warnings)


# ------------------------------------------------------------------------------------------ files
def test_laboratory_file(tmp_path: Any, quiet: Any) -> None:
    """The template, filled with the angles of a day in degrees, gives the same coefficients."""
    system = load_system(NAME)
    lines = system.measured_data.template.splitlines()
    header = lines.pop()
    _, site, rows = held(quiet)
    w = {k: np.asarray(v)[rows] for k, v in quiet.windows.items()}
    names = [f"{a}_{e}" for a in BOTH for e in ("start", "end")]
    number = np.where(w["phase"] == 2, 1, 2).tolist()
    columns = [w["t_start"].tolist(), w["t_end"].tolist(), *(np.degrees(w[n]).tolist() for n in names)]
    body = [",".join([str(p), *(repr(v) for v in row)]) for p, *row in zip(number, *columns, strict=True)]
    text = "\n".join([*lines, header, *body, ""]).replace("9.8067m/s2", f"{site.gravity!r}m/s2")
    file = tmp_path / "day.csv"
    file.write_text(text, encoding="utf-8")
    record = system.read_measured(file, {"nuisances": "none"})  # as the record without noise
    record.run.parameters["site.earth_rate"] = site.earth_rate
    expected = load_system(NAME).reduce(quiet).coefficients
    for a, b in zip(reduce_undiagnosed(record).coefficients, expected, strict=True):
        assert a.estimate == pytest.approx(b.estimate, abs=1e-8) and a.truth is None
    file.write_text(text.replace("# phase 2 = mount 4", "# phase 2 = mount 14"), encoding="utf-8")
    with pytest.raises(Exception, match="phase 2: 'mount 14' is no attitude"):
        load_system(NAME).read_measured(file, {})
    file.write_text(text.replace("inner_end [deg]", "inner_end [s]"), encoding="utf-8")
    with pytest.raises(Exception, match="column 'inner_end': wrong unit"):
        load_system(NAME).read_measured(file, {})


def test_delays(quiet: Any) -> None:
    """The loops are cut where the tables hold."""
    assert set(quiet.run.delays) == {
        "coupling.u_outer -> outer.u", "gyro.u_y -> inner.u", "cage_x.i -> gyro.i_y", "cage_y.i -> gyro.i_x",
        "outer.angle -> wobble_x.angle", "inner.angle -> wobble_y.angle",
        "outer.angle_read -> sequencer.angle", "coupling.in_position -> sequencer.in_position",
    }  # fmt: skip


@pytest.mark.long
def test_stopped_and_continued(tmp_path: Any) -> None:
    """Stopped in the first mount, noise and quantum on, and continued: the record is bit-equal."""
    whole = run(NAME, values=NOISY, seed=3)
    with pytest.raises(RunError, match="--resume"):
        run(NAME, values=NOISY, seed=3, out=tmp_path / "day", stop_at=90.0)
    again = run(NAME, values=NOISY, seed=3, out=tmp_path / "day", resume=True)
    assert again.same_data(whole) and again.run.resumed_at == pytest.approx([90.0], abs=2e-3)
