"""TEST-TUMBLE1-SDF: sensitivities, budget, tests of the model and of the noise, what a result and a run hold."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest
import tumble as T

from gyrobench import drift, frames
from gyrobench.record.record import Record
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.estimation import noise
from gyrobench.reduction.estimation.verdict import conclude
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import Result

DPH = T.DPH
NAMES = T.NAMES


def test_sensitivities_of_the_method() -> None:
    """[TUM1-SENS-IA] eps W sin(phi)/gamma in D_O by the closed formulas; [TUM1-SENS-AXIS] W delta/(gamma cos phi) in
    D_I (the axis tilts about east) and 2 W delta/(gamma^2 sin 2 phi) in D_OS (about p x east)."""
    truth = dict.fromkeys(NAMES, 0.0)
    s = T.setup(gravity=frames.G0, truth=truth)
    phi, eps, W = s.latitude, 1e-4, frames.EARTH_RATE / DPH

    def closed(real: Any) -> dict[str, float]:
        r = T.reduction.Reduction.reduce(T.record(real, truth), s)
        return {c.name: c.closed for c in r.coefficients}

    tilt = frames.rotation([0, 0, 1], eps).T
    found = closed(T.setup(gravity=frames.G0, faces={p: tilt @ f for p, f in s.faces.items()}))
    assert abs(found.pop("D_O")) == pytest.approx(eps * W * math.sin(phi), rel=1e-6)
    assert max(map(abs, found.values())) < 1e-6
    off = T.setup(gravity=frames.G0)
    for axis, name, size in ((0, "D_I", W / math.cos(phi)), (1, "D_OS", 2 * W / math.sin(2 * phi))):
        tilted = off.base @ frames.rotation(off.base[axis], eps).T
        assert abs(closed(T.setup(gravity=frames.G0, base=tilted))[name]) == pytest.approx(eps * size, rel=1e-3)


@pytest.mark.long
@pytest.mark.usefixtures("fewer_weights")
def test_budget_lines_are_what_a_wrong_assumption_does() -> None:
    """Each line's sensitivity equals the change of the estimates when the record is made with that error in it.  The
    errors are stated so small that they move no weights: stated in full, each record would have weights of its own.
    """
    truth, faint = T.random_truth(8), 1e-9
    sizes = {"u_axis": 1e-5, "u_mount": 1e-5, "u_scale_factor": 1e-4, "u_nonlinearity": 1e-4, "u_current": 1e-9}
    s = T.setup(truth=truth, **{n: v * faint for n, v in sizes.items()})
    w = T.record(s, truth, noise=T.white(1e-6))
    r = T.reduction.Reduction.reduce(w, s)
    base = {c.name: c.estimate for c in r.coefficients}

    def change(windows: Any) -> dict[str, float]:
        found = T.reduction.Reduction.reduce(windows, s)
        return {c.name: c.estimate - base[c.name] for c in found.coefficients}

    line = {(b.source, b.coefficient): b for b in r.budget}
    gained = change({**w, "mean": w["mean"] * (1 + 1e-4)})
    assert line["torquer scale factor", "D_I"].contribution / faint == pytest.approx(abs(gained["D_I"]), rel=1e-3)
    offset = change({**w, "mean": w["mean"] + 1e-9})
    assert line["offset of the current reading", "D_F"].contribution / faint == pytest.approx(
        abs(offset["D_F"]), rel=1e-3
    )
    tilted = T.setup(base=s.base @ frames.rotation(s.base[0], 1e-5).T)
    off = change(T.record(tilted, truth, noise=T.white(1e-6)))
    mine = line["table axis off the pole, about east", "D_I"]
    assert mine.contribution / faint == pytest.approx(abs(off["D_I"]), rel=1e-3)
    tilt = frames.rotation([0, 0, 1], 1e-9).T  # small against the noise, else it would be taken for slow noise
    turned = T.setup(faces={p: tilt @ f for p, f in s.faces.items()})
    off = change(T.record(turned, truth, noise=T.white(1e-6)))
    assert line["input axis towards output axis", "D_O"].sensitivity == pytest.approx(off["D_O"] / 1e-9, rel=2e-2)
    full = T.reduction.Reduction.reduce(w, T.setup(truth=truth, **sizes))
    for c in full.coefficients:
        total = math.sqrt(sum(b.contribution**2 for b in full.budget if b.coefficient == c.name))
        assert c.u == pytest.approx(total, rel=1e-9)
        assert c.u > c.u_a


@pytest.mark.long
def test_tilt_of_the_input_axis_can_be_estimated() -> None:
    """Both mounts see it with the table rate, the dwells with Earth rate alone: a tenth unknown, and D_O unharmed."""
    truth, eps = T.random_truth(8), 1e-4
    s = T.setup(truth=truth, tilt=True, u_mount=1e-4)
    tilt = frames.rotation([0, 0, 1], eps).T
    tilted = T.setup(faces={p: tilt @ f for p, f in s.faces.items()})
    r = T.reduction.Reduction.reduce(T.record(tilted, truth, noise=T.white(1e-5)), s)
    found = {c.name: c for c in r.coefficients}
    assert found["ε_IO"].estimate == pytest.approx(math.degrees(eps) * 3600, rel=1e-3) and found["ε_IO"].unit == "″"
    assert all(abs(c.estimate - c.truth) < 5e-4 for c in r.coefficients if c.truth is not None)  # eps times D
    size = {b.coefficient: b.contribution for b in r.budget if b.source == "input axis towards output axis"}
    assert size["D_O"] < 1e-4 * 1.01  # only eps D_I, no rate any more
    loose = T.reduction.Reduction.reduce(
        T.record(tilted, truth, noise=T.white(1e-5)), T.setup(truth=truth, u_mount=1e-4)
    )
    assert abs(loose.coefficients[2].z) < 2  # the steps between the mounts are taken for slow noise
    plain = T.reduction.Reduction.reduce(T.record(s, truth, noise=T.white(1e-5)), T.setup(truth=truth, u_mount=1e-4))
    assert any("tilt=yes" in text for text in plain.warnings)


def test_result_is_whole_and_json() -> None:
    s = T.setup(truth=drift.STANDARD)
    found = T.reduction.Reduction.reduce(T.record(s, drift.STANDARD, turns=2, noise=T.white(0.003)), s)
    r = conclude(found, None, {"D_F": (-0.5, 0.5), "D_I": (None, -1.0), "D_S": (-0.701, None)})
    text = json.dumps(r.as_dict(), allow_nan=False)
    assert Result.from_dict(json.loads(text)).coefficients[0].estimate == r.coefficients[0].estimate
    verdicts = {c.name: c.verdict for c in r.coefficients}
    assert verdicts["D_F"] == "pass" and verdicts["D_I"] == "fail" and verdicts["D_II"] == "no specification given"
    assert r.verdict == "fail"
    assert (
        len(r.series) == 4
        and len(r.series[1].x) == 144
        and len(r.series[1].shown_fit_x) == len(r.series[1].shown_fit_y)
    )
    assert {t.name for t in r.tests} >= {"Ljung-Box, residuals", "turn to turn", "harmonics 3 and higher"}
    assert r.allan.tau and r.psd.f and r.acf.rho[0] == pytest.approx(1.0)
    assert r.repeatability["p"] > 1e-3
    assert len(r.tables) == 2 and r.tables[1].rows[0][:2] == ["mount 1", 1]
    assert len(r.summary) == 3
    for c in r.coefficients:
        assert c.interval[1] - c.interval[0] == pytest.approx(2 * c.k * c.u)
        assert abs(c.estimate - c.closed) < 5 * c.u
    assert r.correlation[0][0] == 1.0 and len(r.correlation) == 9


def test_model_errors_are_found() -> None:
    """A third harmonic, and a drift that changes between turns, show in their tests and nowhere else."""
    s = T.setup()
    w = T.record(s, drift.STANDARD, turns=2, noise=T.white(0.003))
    mount = np.isin(w["phase"], (2, 4))
    angle = (w["angle_start"] + w["angle_end"]) / 2
    third = {**w, "mean": w["mean"] + np.where(mount, 0.003 * DPH / s.k * np.cos(3 * angle), 0.0)}
    p = {t.name: t.p for t in T.reduction.Reduction.reduce(third, s).tests}
    assert p["harmonics 3 and higher"] < 1e-3 < p["turn to turn"]
    two = np.flatnonzero(w["phase"] == 2)[72:]
    changed = np.array(w["mean"])
    changed[two] += 0.005 * DPH / s.k * np.sin(2 * angle[two])
    p = {t.name: t.p for t in T.reduction.Reduction.reduce({**w, "mean": changed}, s).tests}
    assert p["turn to turn"] < 1e-2 < p["harmonics 3 and higher"]


def test_correlated_noise_is_seen_and_said() -> None:
    def markov(t0: np.ndarray, t1: np.ndarray) -> np.ndarray:
        root = np.linalg.cholesky(noise.process_covariance(t0, t1, 360.0))
        return root @ np.random.default_rng(3).standard_normal(t0.size) * 0.005 * DPH

    s = T.setup(truth=drift.STANDARD)
    w = T.record(s, drift.STANDARD, noise=markov)
    r = T.reduction.Reduction.reduce(w, s)
    p = {t.name: t.p for t in r.tests}
    assert p["Ljung-Box, residuals"] < 1e-6 < 1e-2 < p["Ljung-Box, whitened residuals"]
    assert r.noise["weight of white noise alone"] < 1e-3
    low, high = r.noise["correlation time, 90 % range / s"]
    assert low < 360.0 < high
    assert "correlation time about" in r.summary[2]
    quiet = T.reduction.Reduction.reduce(T.record(s, drift.STANDARD, noise=T.white(0.005)), s)
    assert r.coefficients[0].u > 1.5 * quiet.coefficients[0].u


def test_from_a_run() -> None:
    """The setup comes from run.json: options, plan, gyro parameters; an unfinished run says so."""
    system = T.system.with_values({"dwell": 600.0, "windows": 36})
    plan = system.plan().rows()
    faces = frames.tumble_faces(system["latitude"])
    parameters = {"gyro.k": T.K, **{f"gyro.{n}": v for n, v in drift.STANDARD.items()}}
    document = RunDocument(
        options=dict(system.values), plan=plan, parameters=parameters, complete=False, stopped_at=9.0
    )
    s = T.reduction.Reduction.setup_of(document)
    assert s.gravity == pytest.approx(frames.normal_gravity(system["latitude"]))
    assert {p: s.turns(p) for p in s.faces} == {r["phase"]: r["mode"] == "rate" for r in plan}
    assert s.faces[2] == pytest.approx(faces["mount 1"])
    r = system.reduce(Record(T.record(s, drift.STANDARD, turn=36), {}, document))
    assert all(abs(c.estimate - c.truth) < 1e-9 for c in r.coefficients)
    assert "before the end of its plan" in r.warnings[0] and r.simulated and r.provenance["plan"] == plan
    assert next(x for x in r.reasons if x.id == "record.incomplete").blocks == ("pass", "fail")
    del document.parameters["gyro.k"]
    with pytest.raises(ReductionError, match="scale factor unknown"):
        T.reduction.Reduction.setup_of(document)
