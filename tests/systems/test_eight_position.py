"""The eight-position test as a co-simulation: recovery, refusals, set-up errors, laboratory files, several days."""

from __future__ import annotations

import csv
import io
import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commanding import Command
from reducing import named
from reducing import reduced_run as reduced
from scipy import stats
from undiagnosed import reduce_undiagnosed

from gyrobench import drift, frames
from gyrobench.engine.session import Session
from gyrobench.record.csv_reader import DataError
from gyrobench.record.multi_day_record import combine
from gyrobench.record.record import Record
from gyrobench.system.system import InvalidConfigurationError, System, load_system
from gyrobench.system.values import InvalidValueError

NAME = "eight_position"
DPH = math.pi / 648000.0
KU = DPH / 1e-3
W = frames.EARTH_RATE
LIMIT = 1e-6  # deg/h

#: 112 s; the slowest pole of the loops, -11.3 1/s, leaves exp(-34) of a change of position after 3 s.
SHORT: dict[str, Any] = {"cycles": 2, "readings": 2, "dwell": 4.0, "settle": 3.0}


def load() -> System:
    return load_system(NAME)


QUIET = {"nuisances": "none", **{n: 0.0 for n in load().noises}}


def gyro(rng: np.random.Generator, terms: int = 10) -> dict[str, Any]:
    """Random coefficients of both channels, all ``terms``, and random scale factors."""
    found: dict[str, Any] = {"gyro.k_x": rng.uniform(15.0, 19.0) * KU, "gyro.k_y": rng.uniform(15.0, 19.0) * KU}
    for c in "xy":
        found[f"gyro.terms_{c}"] = terms
        for n in drift.terms_2dof(c, terms):
            size = (0.5, 1.2, 0.1)[drift.order(n)]
            found[f"gyro.{n}"] = float(rng.uniform(-size, size) * DPH)
    return found


def latitude(rng: np.random.Generator) -> float:
    return float(math.radians(rng.uniform(0.0, 75.0)) * rng.choice([-1.0, 1.0]))


# ------------------------------------------------------------------------------------------ recovery
@pytest.mark.parametrize("seed", range(5))
def test_random_gyros_at_random_latitudes(session: Session, seed: int) -> None:
    """All twelve combinations of all twenty coefficients, noise off, gravity away from g0.  At rest the loops balance
    exactly (they integrate twice), so nothing is left but the settling and rounding.
    """
    rng = np.random.default_rng(seed)
    values = {**SHORT, **QUIET, **gyro(rng), "latitude": latitude(rng), "gravity": 9.79}
    result = reduced(session, values)
    D = {n[5:]: v / DPH for n, v in values.items() if n.startswith("gyro.D")}
    g = 9.79 / 9.80665
    expected = {  # by hand from k_x i_x = w_y - w_dy, k_y i_y = w_x - w_dx in the eight positions
        "k_x": values["gyro.k_x"] / KU, "R_x": D["Dy_0"] + g * g * D["Dy_xx"], "u_zx": -g * D["Dy_y"],
        "u_y": g * D["Dy_z"] - g * g * (D["Dy_zz"] - D["Dy_xx"]), "Dy_yy − Dy_xx": D["Dy_yy"] - D["Dy_xx"],
        "Dy_x": D["Dy_x"], "k_y": values["gyro.k_y"] / KU, "R_y": -(D["Dx_0"] + g * g * D["Dx_yy"]),
        "u_zy": -g * D["Dx_x"], "u_x": g * D["Dx_z"] - g * g * (D["Dx_zz"] - D["Dx_yy"]),
        "Dx_xx − Dx_yy": D["Dx_xx"] - D["Dx_yy"], "Dx_y": D["Dx_y"],
    }  # fmt: skip
    assert {c.name for c in result.coefficients} == set(expected)
    for c in result.coefficients:
        assert c.estimate == pytest.approx(expected[c.name], abs=LIMIT), c.name
        assert c.truth == pytest.approx(expected[c.name], abs=1e-12), c.name
        if c.closed is not None:
            assert c.closed == pytest.approx(c.estimate, abs=1e-9)
    assert result.simulated


def test_nutation_and_damping_change_nothing(session: Session) -> None:
    rng = np.random.default_rng(20)
    dynamics = {"gyro.J_x": 2e-4, "gyro.J_y": 1e-4, "gyro.C_x": 0.02, "gyro.C_y": 0.02}
    values = {**SHORT, **QUIET, **gyro(rng), "latitude": latitude(rng)}
    plain, nutating = named(reduced(session, values)), named(reduced(session, {**values, **dynamics}))
    for n, c in plain.items():
        assert nutating[n].estimate == pytest.approx(c.estimate, abs=LIMIT), n


@pytest.mark.usefixtures("fewer_weights")
def test_four_terms_are_biased_and_say_so(session: Session) -> None:
    result = reduced(session, {**SHORT, **QUIET, "terms": 4})
    assert len(result.coefficients) == 8
    assert any("simulated but not in the 4-term model" in w for w in result.warnings)
    R = named(result)["R_x"]
    assert abs(R.estimate - R.truth) > 1e-3 and R.closed == pytest.approx(R.truth, abs=LIMIT)


def test_rows_of_both_samplers_belong_together(session: Session) -> None:
    """One counter is watched: its row holds the other sampler's same window.  Drift alone tells: I_y of position 1 has
    no Earth rate, I_x has; and the second sampler's own times are those of the row.
    """
    columns = {**load().windows.columns, "t_start_y": "sampler_y.t_start", "t_end_y": "sampler_y.t_end",  # type: ignore[union-attr]
               "n_y": "sampler_y.n", "phase_y": "sampler_y.window_phase"}  # fmt: skip
    system = load()
    type(system).windows, kept = type(load().windows)(load().windows.watch, columns), type(system).windows  # type: ignore[union-attr,misc]
    try:
        with Session(system) as s:
            w = s.run({**SHORT, **QUIET}).windows
    finally:
        type(system).windows = kept  # type: ignore[misc]
    for n in ("t_start", "t_end", "n", "phase"):
        assert np.array_equal(w[n], w[f"{n}_y"]), n
    assert len(w["n"]) == 32 and np.all(w["n"] == 2000)


def test_dynamic_against_quasi_static_with_noise(session: Session) -> None:
    """k i = omega - omega_d by position and the co-simulation agree: exactly without noise, within it with noise."""
    rng = np.random.default_rng(30)
    phi = latitude(rng)
    values = {**SHORT, **gyro(rng), "latitude": phi, "cycles": 4}
    record = session.run({**values, **QUIET})
    g = frames.normal_gravity(phi) / frames.G0
    faces, mean = load().plan().faces, {}
    for c, axis in (("x", 1), ("y", 0)):
        other = "y" if c == "x" else "x"
        names = drift.NAMES_2DOF[other]
        D = np.array([values.get(f"gyro.{n}", 0.0) for n in names])
        rates = []
        for p in record.run.plan:
            C = np.asarray(faces[p.face])
            w = W * float(C[axis] @ frames.pole(phi))
            rates.append((w - float(drift.regressors(C @ -frames.U * g, names) @ D)) / values[f"gyro.k_{c}"])
        mean[f"mean_{c}"] = np.repeat(rates, 2)
        assert np.max(np.abs(mean[f"mean_{c}"] - record.windows[f"mean_{c}"])) * 17.0 / 1e-3 < LIMIT
    static = named(load().reduce(Record({**record.windows, **mean}, {}, record.run)))
    noisy = named(reduced(session, values, seed=3))
    for n, c in noisy.items():
        assert abs(c.estimate - static[n].estimate) < 4.0 * c.u, n
        assert c.u > 1e-4


# ------------------------------------------------------------------------------------------ set-up errors
def test_tilted_table_shifts_as_by_hand(session: Session) -> None:
    """The head tilted about east by eps: north' = N + eps U, up' = U - eps N.  Positions 2 and 4, x = +-N':

        k_y (I_2 - I_4) = 2 (W cos phi + eps (W sin phi) + eps (-u_zy))   (x down by -eps: g_x = -+eps)

    so k_y is read too small by (tan phi - u/(W cos phi)) eps, relative.  With compliance the unbalance is not u_zy
    alone there: the drift per g_x at g_z = -1 is Dx_x - Dx_xz, so u = u_zy + Dx_xz (gamma = 1 to 1e-4).
    """
    eps, phi = 1e-4, math.radians(45.75)
    values = {**SHORT, **QUIET, "latitude": phi}
    plain = named(reduced(session, values))
    tilted = named(reduced(session, {**values, "table.tilt": [eps, 0.0]}))
    u = (plain["u_zy"].estimate - 0.15) * DPH  # Dx_xz of the standard gyro
    expected = -(math.tan(phi) - u / (W * math.cos(phi))) * eps
    assert tilted["k_y"].closed / plain["k_y"].closed - 1.0 == pytest.approx(expected, rel=1e-3)
    assert abs(expected) > 9e-5


def test_budget_predicts_a_turned_gyro(session: Session) -> None:
    """The gyro turned about its x axis in the fixture by 20 arcsec: the line of the budget is the shift."""
    eps = 20.0 * DPH  # rad: 20 arcsec
    values = {**SHORT, **QUIET, "u_mount": eps}
    plain = reduced(session, values)
    mount = frames.rotation([1.0, 0.0, 0.0], eps).T.tolist()
    turned = named(reduced(session, {**values, "gyro.mount": mount}))
    lines = {b.coefficient: b.contribution for b in plain.budget if "about its x axis" in b.source}
    shifts = {c.name: turned[c.name].closed - c.closed for c in plain.coefficients if c.closed is not None}
    assert abs(shifts["R_x"]) > 5e-4
    for n, shift in shifts.items():
        # products of gravity components (compliance 0.15 deg/h/g2 times eps) and eps squared are left out
        assert abs(shift) == pytest.approx(lines.get(n, 0.0), rel=0.1, abs=4e-5), n


def test_a_latitude_stated_too_large(session: Session) -> None:
    """By delta: W cos phi is taken for less, and k by tan phi delta with it; the budget says so with sign."""
    delta, phi = 1e-4, math.radians(45.75)
    record = session.run({**SHORT, **QUIET, "latitude": phi, "u_latitude": delta})
    stated = record.run.replace(options={**record.run.options, "latitude": phi + delta})
    plain, off = load().reduce(record), named(load().reduce(Record(record.windows, {}, stated)))
    lines = {b.coefficient: b.sensitivity * delta for b in plain.budget if b.source == "latitude"}
    k = named(plain)["k_x"].estimate
    assert off["k_x"].estimate - k == pytest.approx(-math.tan(phi) * delta * k, rel=1e-2)
    for c in plain.coefficients:
        assert off[c.name].estimate - c.estimate == pytest.approx(lines.get(c.name, 0.0), rel=0.02, abs=1e-6), c.name


def test_corrections_of_one_position_and_of_one_meter(session: Session) -> None:
    """Position 3 turned by 60 arcsec about its z axis: W cos phi eps less along x; both faults are taken out, and the
    zero of one meter leaves the other channel alone.
    """
    eps, values = 60.0 * DPH, {**SHORT, **QUIET}  # rad: 60 arcsec
    faces = [np.asarray(f, dtype=float) for f in load().plan().faces.values()]
    faces[2] = frames.rotation([0.0, 0.0, 1.0], eps).T @ faces[2]
    wrong = {"sequencer.faces": [f.ravel().tolist() for f in faces]}
    zero = 1e-6  # A
    plain, record = named(reduced(session, values)), session.run({**values, **wrong})
    windows = {**record.windows, "mean_x": record.windows["mean_x"] + zero}
    source = f"attitude of each position (position 3 about z) = {eps!r}(1e-6) rad"
    off, right = (
        named(load().reduce(Record(windows, {}, record.run.replace(options={**record.run.options, "corrections": c}))))
        for c in ("", f"{source}; zero of the x current meter = 1(0.1) uA")
    )
    k = plain["k_x"].estimate * 1e-3  # deg/h/uA
    assert off["R_x"].estimate - plain["R_x"].estimate == pytest.approx(-k, rel=0.02)
    shifts = {n: off[n].estimate - c.estimate for n, c in plain.items()}
    assert abs(shifts["u_x"]) > 4e-4
    for n, c in plain.items():
        assert abs(right[n].estimate - c.estimate) < 2e-5, (n, shifts[n])


# ------------------------------------------------------------------------------------------ refusals
REFUSED = [
    ({"latitude": math.radians(86.0)}, "to 85° north or south"),
    ({"latitude": math.radians(-85.5)}, "to 85° north or south"),
    ({"cycles": 1}, "set sigma=false"),
    ({"cycles": 1, "readings": 1, "sigma": False}, "leaves no noise"),
    ({"terms": 5}, "4 or 6 unknowns"),
    ({"gravity": 9.5}, "outside 9.7..9.9"),
    ({"table.tilt": [math.radians(1.1), 0.0]}, "position 1: attitude is 1.1° off"),
    ({"gyro.mount": frames.rotation([0, 0, 1], math.radians(2.0)).tolist()}, "x, y, z should be E, N, U"),
    ({"gyro.mount": [[1, 0, 0], [0, 1, 0], [0, 0, -1]]}, "left-handed"),
    ({"table.base": [[1, 0, 0], [0, 1, 0.1], [0, 0, 1]]}, "table.base: rows are not orthonormal"),
]


@pytest.mark.parametrize(("values", "said"), REFUSED)
def test_refused_before_running(session: Session, values: dict[str, Any], said: str) -> None:
    with pytest.raises(InvalidConfigurationError) as error:
        session.run({**SHORT, **values})
    assert said in str(error.value)


def test_bounds_and_warnings(session: Session) -> None:
    for values in ({"settle": 0.5}, {"cycles": 13}, {"latitude": "95deg"}, {"dwell": "1m"}):
        with pytest.raises(InvalidValueError):
            load().with_values(values)
    with pytest.raises(InvalidConfigurationError, match="exchanges once a step"):
        session.run(SHORT, step=0.01)
    record = session.run({**SHORT, **QUIET, "latitude": math.radians(81.0), "table.tilt": [math.radians(0.5), 0.0]})
    assert any("beyond 80°" in n for n in record.run.notes)


def test_saturation_is_refused(session: Session) -> None:
    """15 deg/h need 0.9 mA; a torquer that ends at 0.3 mA leaves flagged windows, of which there is no mean."""
    record = session.run({**SHORT, **QUIET, "rebalance_x.i_max": 3e-4})
    with pytest.raises(ValueError, match="x current: flagged windows"):
        load().reduce(record)


# ------------------------------------------------------------------------------------------ laboratory files
def laboratory(record: Record, extra: str = "", day: dict[int, int] | None = None) -> str:
    out = io.StringIO()
    out.write(f"# latitude = 45.75 deg\n# instrument = RIG 8\n{extra}")
    writer = csv.writer(out, lineterminator="\n")
    head = ["position", "cycle", "t_start [min]", "t_end [min]", "mean_x [uA]", "mean_y [mA]", "remark"]
    writer.writerow([*head, *(["day"] if day else [])])
    face = {p.phase: int(p.face.split()[1]) for p in record.run.plan}
    w = record.windows
    for j, phase in enumerate(w["phase"].tolist()):
        row = [face[phase], (phase - 1) % 16 // 8 + 1, w["t_start"][j] / 60, w["t_end"][j] / 60]
        writer.writerow([*row, w["mean_x"][j] * 1e6, w["mean_y"][j] * 1e3, "", *([day[phase]] if day else [])])
    return out.getvalue()


def from_file(command: Command, folder: Path, text: str, *more: str) -> dict[str, Any]:
    folder.mkdir(exist_ok=True)
    (folder / "lab.csv").write_text(text, encoding="utf-8")
    code, _, err = command("reduce", NAME, "--data", folder / "lab.csv", "--out", folder / "out", *more)
    assert code == 0, err
    found: dict[str, Any] = json.loads((folder / "out" / "result.json").read_text("utf-8"))
    return found


@pytest.mark.long
def test_laboratory_file(session: Session, command: Command, tmp_path: Path) -> None:
    record = session.run(SHORT, seed=4)
    expected = load().reduce(record)
    found = from_file(command, tmp_path, laboratory(record))
    assert found["simulated"] is False and found["instrument"] == "RIG 8"
    for c, e in zip(found["coefficients"], expected.coefficients, strict=True):
        assert c["name"] == e.name and c["truth"] is None
        assert c["estimate"] == pytest.approx(e.estimate, abs=1e-8)
        assert c["u"] == pytest.approx(e.u, rel=1e-4)


def test_template_is_read_back(command: Command, tmp_path: Path) -> None:
    """Filled with the currents of a gyro with R_x = 0.4 deg/h only (k = 17 deg/h/mA, at 45.75 deg)."""
    code, template, err = command("reduce", NAME, "--template")
    assert code == 0, err
    c, s = 15.041067 * math.cos(math.radians(45.75)), 15.041067 * math.sin(math.radians(45.75))
    I_x = {1: c, 2: 0.0, 3: -c, 4: 0.0, 5: 0.0, 6: s, 7: 0.0, 8: -s}
    I_y = {1: 0.0, 2: c, 3: 0.0, 4: -c, 5: s, 6: 0.0, 7: -s, 8: 0.0}
    rows = [
        f"{cycle},{n},{t},{t + 60},{(I_x[n] - 0.4) / 17!r},{I_y[n] / 17!r}"
        for cycle in (1, 2)
        for n in I_x
        for t in [((cycle - 1) * 8 + n) * 100]
    ]
    by = {c["name"]: c["estimate"] for c in from_file(command, tmp_path, template + "\n".join(rows))["coefficients"]}
    assert by["R_x"] == pytest.approx(0.4, abs=1e-6) and by["k_x"] == pytest.approx(17.0, abs=1e-5)
    assert by["R_y"] == pytest.approx(0.0, abs=1e-6) and by["u_zx"] == pytest.approx(0.0, abs=1e-5)


def test_bad_laboratory_files(session: Session, tmp_path: Path) -> None:
    record = session.run({**SHORT, **QUIET})
    good = laboratory(record)
    for text, said in (
        (good.replace("# latitude = 45.75 deg\n", ""), "'latitude' is not given"),
        (good.replace("mean_y [mA]", "mean_y [V]"), "wrong unit"),
        (good.replace("mean_y [mA]", "mean [mA]"), "column 'mean_y [A]' is missing"),
        (re.sub(r"^8,", "9,", good, flags=re.M), "position 9 unknown"),
    ):
        (tmp_path / "bad.csv").write_text(text, encoding="utf-8")
        with pytest.raises(DataError, match=re.escape(said)):
            load().read_measured(tmp_path / "bad.csv", {})
    missing = "\n".join(t for t in good.splitlines() if not t.startswith("6,"))
    (tmp_path / "six.csv").write_text(missing, encoding="utf-8")
    with pytest.raises(ValueError, match="position 6 missing"):
        load().reduce(load().read_measured(tmp_path / "six.csv", {}))


# ------------------------------------------------------------------------------------------ days
@pytest.mark.long
def test_days_of_turn_on(session: Session, tmp_path: Path) -> None:
    """Five days whose turn-on constants are drawn with 0.1 deg/h about x: R_y scatters by that, u_x does not; the list
    of the runs and a laboratory's file with a column day give the same.
    """
    values = {**SHORT, "gyro.turn_on_x": 0.1 * DPH}
    folders, records = [], []
    for seed in range(5):
        folders.append(tmp_path / f"run{seed}")
        records.append(session.run(values, seed=seed, out=folders[-1]))
    (tmp_path / "days.csv").write_text("# five days\nrun\n" + "\n".join(f.name for f in folders) + "\n", "utf-8")
    combined = load().read_measured(tmp_path / "days.csv", {})
    result = load().reduce(combined)
    by = named(result)
    each = [named(load().reduce(r))["R_y"].estimate for r in records]
    sigma = result.repeatability["σ of R_y / (°/h)"]
    assert by["R_y"].estimate == pytest.approx(np.mean(each))
    assert sigma == pytest.approx(np.std(each, ddof=1)) and 0.03 < sigma < 0.25
    half = float(stats.t.ppf(0.975, 4)) * sigma / math.sqrt(5)
    assert by["R_y"].interval[1] - by["R_y"].estimate == pytest.approx(half)
    p = {t.name: t.p for t in result.tests}
    assert p["day to day, R_y"] < 1e-6 and p["day to day, u_x"] > 1e-3
    assert len(next(t for t in result.tables if t.title == "Estimates by day").rows) == 8

    day = {p.phase: 1 + [f.name for f in folders].index(p.day) for p in combined.run.plan}
    (tmp_path / "lab.csv").write_text(laboratory(combined, day=day), encoding="utf-8")
    again = reduce_undiagnosed(load().read_measured(tmp_path / "lab.csv", {}))
    for c in again.coefficients:
        assert c.estimate == pytest.approx(by[c.name].estimate, abs=1e-7), c.name


def test_days_that_do_not_go_together(session: Session, tmp_path: Path) -> None:
    first, second = session.run({**SHORT, **QUIET}), session.run({**SHORT, **QUIET, "gyro.Dx_0": 1e-6})
    with pytest.raises(DataError, match=r"other parameters: gyro\.Dx_0"):
        combine([first, second], ["a", "b"])
    third = session.run({**SHORT, **QUIET, "latitude": 0.5})
    with pytest.raises(DataError, match="other options: latitude"):
        combine([first, third], ["a", "b"])
    first.save(tmp_path / "a")
    for text, said in (("run\na\n", "at least two"), ("run\na\na\n", "named twice"), ("run\na\nb\n", "No such file")):
        (tmp_path / "days.csv").write_text(text, encoding="utf-8")
        with pytest.raises(DataError, match=said):
            load().read_measured(tmp_path / "days.csv", {})
