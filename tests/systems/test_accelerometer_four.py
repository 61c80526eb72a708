"""Four accelerometers on one head: coefficients, head errors and intervals against records written from the equations.

The table of errors by method over 400 records: tests/benchmarks/accelerometer_four.py.
"""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from accelerometers_four import ALPHA, ARCSEC, TRUE, N, head, voltages, windows
from commanding import Command
from stated import with_sizes

from gyrobench.engine.session import Session
from gyrobench.frames import G0
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.system.system import load_system
from systems.accelerometer_four import chain, geometry
from systems.accelerometer_four.reduction import FourSetup, Reduction

NAME = "accelerometer_four"
D1 = (1.5e-5, -1.9e-6)


def setup(**values: object) -> FourSetup:
    return FourSetup(**with_sizes({"gravity": G0, "D1": D1, **values}))  # type: ignore[arg-type]


def reduced(U: np.ndarray, **values: object) -> np.ndarray:
    """The coefficients (4, 5) of a record."""
    found = Reduction.reduce(windows(U), setup(**values))
    return np.array([c.estimate for c in found.coefficients[:20]]).reshape(4, 5)


def test_exact_without_noise() -> None:
    """Errors of +-11 arcsec: coefficients to 1e-7 V, and the harmonics of the head are those put in."""
    rng = np.random.default_rng(1)
    D = head(rng, 11 * ARCSEC, D1)
    found = Reduction.reduce(windows(voltages(rng, D, 0.0)), setup())
    assert np.array([c.estimate for c in found.coefficients[:20]]).reshape(4, 5) == pytest.approx(TRUE, abs=1e-7)
    table = next(t for t in found.tables if t.title.startswith("Angle errors"))
    back = sum(a * ARCSEC * (np.cos(k * ALPHA) if kind == "cos" else np.sin(k * ALPHA)) for k, kind, a, _ in table.rows)
    assert back == pytest.approx(D, abs=2e-9)


def test_41_unknowns_of_96_readings() -> None:
    """Rank 41, 55 degrees of freedom; columns of the harmonics 0 and 1 of the head raise the rank by none."""
    found = Reduction.reduce(
        windows(voltages(np.random.default_rng(2), head(np.random.default_rng(3), 1e-5), 3e-6)), setup()
    )
    assert found.dof == pytest.approx(55) and len(geometry.orders(N)) == 21
    X = np.zeros((4 * N, 44))
    for j, i in enumerate(geometry.SENSORS):
        rows = slice(j * N, (j + 1) * N)
        X[rows, 5 * j : 5 * j + 5] = chain.design(i, ALPHA, 1.0)
        tangent = geometry.axes(i, ALPHA)[1][:, None]
        low = np.column_stack([np.ones(N), np.cos(ALPHA), np.sin(ALPHA)])
        X[rows, 20:] = tangent * np.column_stack([geometry.harmonics(ALPHA, N), low])
    assert np.linalg.matrix_rank(X[:, :41]) == 41 == np.linalg.matrix_rank(X)


@pytest.mark.long
def test_errors_and_intervals() -> None:
    """+-11 arcsec, 3 uV, D1 known to 5e-7 rad: rms of 80 records as the design says, K_I and K_O 0.98, F 1.34, IO and
    II 2.0 uV within 20 %; intervals hold 95 % +- 2.5 (1600, some correlated); the sensors alone are ten times worse.
    """
    rng = np.random.default_rng(5)
    error, held, ratio = [], [], []
    for _ in range(80):
        U = voltages(rng, head(rng, 11 * ARCSEC, D1), 3e-6)
        measured = (D1[0] + 5e-7 * rng.normal(), D1[1] + 5e-7 * rng.normal())
        found = Reduction.reduce(windows(U), setup(D1=measured, u_D1=5e-7))
        c = found.coefficients[:20]
        error.append([x.estimate - t for x, t in zip(c, TRUE.ravel(), strict=True)])
        held.append([x.interval[0] <= t <= x.interval[1] for x, t in zip(c, TRUE.ravel(), strict=True)])
        ratio.append(float(np.mean(chain.alone(ALPHA, U, 1.0)[1])) / found.residual_std)
    rms = np.sqrt(np.mean(np.array(error).reshape(-1, 5) ** 2, axis=0))
    assert rms == pytest.approx([1.34e-6, 0.98e-6, 0.94e-6, 2.05e-6, 2.05e-6], rel=0.2)
    assert abs(float(np.mean(held)) - 0.95) < 0.025
    assert 7.0 < float(np.mean(ratio)) < 12.0


@pytest.mark.long
def test_the_chain_of_the_source_is_as_good() -> None:
    """With D2 and D3 averaged over the sensors its errors are those of the joint fit."""
    rng = np.random.default_rng(6)
    joint, three = [], []
    for _ in range(60):
        U = voltages(rng, head(rng, 11 * ARCSEC), 3e-6)
        joint.append(reduced(U, D1=(0.0, 0.0)) - TRUE)
        three.append(chain.three_steps(ALPHA, U, 1.0) - TRUE)
    a, b = (np.sqrt(np.mean(np.array(x) ** 2, axis=(0, 1))) for x in (joint, three))
    assert b == pytest.approx(a, rel=0.02)


def test_unknown_first_harmonic() -> None:
    """K_I D1 = 1.3 x 1.5e-5 = 1.95e-5 V goes into F and II of sensor 1, the residuals stay; the report says so."""
    rng = np.random.default_rng(7)
    U = voltages(rng, head(rng, 11 * ARCSEC, D1), 1e-7)
    known, unknown = reduced(U), reduced(U, D1=None)
    shift = (unknown - known)[0]
    assert shift == pytest.approx([1.95e-5, 0.0, 0.0, -1.3 * 1.9e-6, -1.95e-5], abs=1e-7)
    found = Reduction.reduce(windows(U), setup(D1=None))
    assert found.residual_std < 3e-7
    assert any("biased by K_I D1" in w for w in found.warnings)


def test_a_23rd_harmonic_of_the_head_passes_for_a_first_one() -> None:
    """On 24 positions cos 23 a = cos a: 5 arcsec of it shift F and II of sensor 1 by K_I 5 arcsec, as D1 does."""
    rng, size = np.random.default_rng(17), 5 * ARCSEC
    D = head(rng, 2 * ARCSEC)
    plain, alias = (reduced(voltages(rng, d, 0.0), D1=(0.0, 0.0)) for d in (D, D + size * np.cos(23.0 * ALPHA)))
    shift = (alias - plain)[0]
    assert shift == pytest.approx([TRUE[0, 1] * size, 0.0, 0.0, 0.0, -TRUE[0, 1] * size], abs=1e-8)


def test_misalignment_and_zero_stand_in_the_output_axis() -> None:
    """eta = 1 mrad of sensor 2: K_O gets K_I eta, K_I loses K_I eta2/2; eta times the head's errors is 5e-8 V."""
    values = {f"accelerometer_{i}.white": 0.0 for i in (1, 2, 3, 4)} | {"accelerometer_2.eta": 1e-3, "dwell": 1.0}
    with Session(load_system(NAME)) as session:
        record = session.run({**values, "settle": 0.5}, seed=1)
    found = Reduction.from_record(record)
    assert found["K_O,2"].estimate == pytest.approx(-7.3e-6 + 1.32453 * 1e-3, abs=1e-8)
    for c in found.coefficients[:20]:
        assert c.estimate == pytest.approx(c.truth, abs=1e-7), c.name


def test_co_simulation_with_noise() -> None:
    """Noise of 3 uV in each reading: twenty normalized errors of three runs are those of a standard normal."""
    z = []
    with Session(load_system(NAME)) as session:
        for seed in (3, 4, 5):
            record = session.run({"head_seed": seed, "dwell": 1.0, "settle": 0.2}, seed=seed)
            z += [float(c.z or 0.0) for c in Reduction.from_record(record).coefficients[:20]]
    assert abs(float(np.mean(z))) < 0.45 and 0.7 < float(np.std(z)) < 1.35


def written(U: np.ndarray, extra: str = "# D1c = 3.094arcsec\n# D1s = -0.392arcsec\n# u_D1 = 0.1arcsec\n") -> str:
    head_line = (
        "phase,t_start [s],t_end [s],angle_start [deg],angle_end [deg],mean [V],mean_2 [V],mean_3 [V],mean_4 [V]"
    )
    rows = [
        ",".join([str(k + 1), str(13 * k), str(13 * k + 10), str(15 * k), str(15 * k), *(repr(float(v)) for v in U[k])])
        for k in range(N)
    ]
    return "\n".join(["# gravity = 9.80665m/s2", "# points = 24", extra + head_line, *rows, ""])


def test_measured_record(command: Command, tmp_path: Path) -> None:
    rng = np.random.default_rng(8)
    U = voltages(rng, head(rng, 11 * ARCSEC, (3.094 * ARCSEC, -0.392 * ARCSEC)), 3e-6)
    (tmp_path / "lab.csv").write_text(written(U), encoding="utf-8")
    code, _, err = command("reduce", NAME, "--data", tmp_path / "lab.csv", "--out", tmp_path / "out")
    assert code == 0, err
    result = json.loads((tmp_path / "out" / "result.json").read_text("utf-8"))
    for c, t in zip(result["coefficients"][:20], TRUE.ravel(), strict=True):
        assert c["estimate"] == pytest.approx(t, abs=4.5 * c["u"]), c["name"]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("# D1c = 3.094arcsec\n", ""), "D1c and D1s are not given"),
        ((",mean_4 [V]", ",note [V]"), "mean_4"),
        (("# points = 24", "# points = 8"), "points"),
        (("\n1,0,10,0,0,", "\n1,0,10,0.5,0.5,"), "is not one of 24"),
    ],
)
def test_measured_record_is_refused(command: Command, tmp_path: Path, change: tuple[str, str], words: str) -> None:
    rng = np.random.default_rng(8)
    text = written(voltages(rng, head(rng, 1e-5), 3e-6))
    assert change[0] in text
    (tmp_path / "lab.csv").write_text(text.replace(*change), encoding="utf-8")
    code, _, err = command("reduce", NAME, "--data", tmp_path / "lab.csv", "--out", tmp_path / "out")
    assert code in (2, 3) and words in " ".join(err.split()) and "Traceback" not in err


def test_a_missing_position_and_a_reversed_voltage_are_refused() -> None:
    rng = np.random.default_rng(9)
    w = windows(voltages(rng, head(rng, 1e-5), 3e-6))
    with pytest.raises(ReductionError, match=r"position 345° is read 0 times"):
        Reduction.reduce({n: v[:-1] for n, v in w.items()}, setup())
    with pytest.raises(ReductionError, match="must be positive"):
        Reduction.reduce({**w, "mean_3": -w["mean_3"]}, setup())
    assert math.isclose(geometry.axes(3, ALPHA)[0][6], -1.0)
