"""Rate gyros in the tests of a gyro at rest and in the north finder: slots, truth, sign, refusals."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from gyrobench import frames
from gyrobench.engine.session import Session
from gyrobench.exchange.ssp_export import export_ssp
from gyrobench.exchange.ssp_import import read_ssp
from gyrobench.result import Result
from gyrobench.system.system import InvalidConfigurationError, System, load_system

DPH = math.pi / 648000.0
PARTS = ("gyro_rate", "gyro_fog", "gyro_laser", "gyro_mems", "gyro_vibratory", "gyro_hemispherical")
#: not counted, so that a short record is white
PLAIN = {"gyro_laser": {"gyro.counting": 0.0}}


def reduced(name: str, part: str, values: dict[str, object], seed: int = 1) -> tuple[System, Result]:
    system = load_system(name).with_values({})
    with Session(system, {"gyro": part}) as session:
        record = session.run({**PLAIN.get(part, {}), **values}, seed=seed)
    result: Result = system.with_values(record.run.options).reduce(record)
    return system, result


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.long
def test_drift_record_gives_the_density_that_the_gyro_shows(part: str) -> None:
    system, result = reduced("drift_record", part, {"duration": 600.0, "window": 0.2})
    assert system["reading"] == "rate" and "rebalance" not in system.slots
    n = next(c for c in result.coefficients if c.name == "N")
    assert n.truth is not None and n.truth > 0.0
    assert abs(n.estimate - n.truth) < 4.0 * n.u  # fixed seed
    assert n.u < 0.1 * n.truth


@pytest.mark.parametrize(("part", "known"), [("gyro_mems", True), ("gyro_vibratory", False)])
@pytest.mark.long
def test_samples_of_a_wide_filter_fold_its_noise(part: str, known: bool) -> None:
    """20 ms between samples of a filter of 50 Hz: k/(T f) = k, N is sqrt(1 + 2 (1/2 + 1/17 + 1/82 + ...)) = 1.469 times
    that before it.  A vibrating gyro, whose loop filters the noise as well, states none.
    """
    values: dict[str, object] = {"duration": 400.0, "window": 0.2, "gyro.period": 0.02, "gyro.bandwidth": 50.0}
    _, result = reduced("drift_record", part, values)
    n = next(c for c in result.coefficients if c.name == "N")
    assert (n.truth is not None) == known
    if known:
        _, plain = reduced("drift_record", part, values | {"gyro.period": 0.0})
        before = next(c for c in plain.coefficients if c.name == "N").truth
        assert n.truth == pytest.approx(1.469 * before, rel=1e-3)
        assert abs(n.estimate - n.truth) < 4.0 * n.u


def test_sign_and_earth_rate_in_the_fixed_position() -> None:
    """The input axis up reads W sin(latitude) + bias: the drift in precession sign is -bias."""
    values: dict[str, object] = {"attitude": "U E", "gyro.bias": [3.0 * DPH, 0.0], "dwell": 60.0, "readings": 10}
    _, result = reduced("fixed_position", "gyro_fog", {**values, "gyro.optical": 0.0})
    drift = result.coefficients[0]
    assert drift.estimate == pytest.approx(-3.0, abs=1e-9)
    table = next(t for t in result.tables if t.id == "from_current_to_drift")
    earth = frames.EARTH_RATE * math.sin(math.radians(45.75)) / DPH
    assert dict((r[0], r[1]) for r in table.rows)["mean rate ω_g"] == pytest.approx(earth + 3.0, rel=1e-9)


def test_a_rate_gyro_at_rest_has_its_own_truth_and_words() -> None:
    """-3 deg/h with a bias of 3; a scale factor that is off reads the Earth rate wrong as well, and states none."""
    values: dict[str, object] = {"gyro.bias": [3.0 * DPH, 0.0], "dwell": 60.0, "readings": 10}
    _, result = reduced("fixed_position", "gyro_fog", values)
    assert result.simulated and result["ω_d"].truth == pytest.approx(-3.0)
    assert any(s.startswith("The bias of the gyro is −ω_d") for s in result.summary)
    assert not any("unbalance" in s for s in result.summary)
    _, other = reduced("fixed_position", "gyro_fog", {**values, "gyro.scale": [1e-3, 0.0]})
    assert other.simulated and other["ω_d"].truth is None


def test_the_word_of_a_gyro_is_in_the_budget_as_far_as_noise_does_not_dither_it() -> None:
    """A word of 36 deg/h alone makes 36/sqrt(12) = 10.4 deg/h; noise of 0.3 words before it leaves the first
    harmonic of rounding, 36/(pi sqrt 2) exp(-2 (0.3 pi)2) = 1.37 deg/h, noise of ten words nothing.

    White noise of density N has the rms N sqrt(f pi/sqrt 2) behind the filter of f = 50 Hz: 10.5 N per sqrt(Hz).
    """
    q = 36.0 * DPH
    for white, u in (
        (1e-9, 10.392),
        (0.3 * q / 10.539, 36.0 / 4.4429 * math.exp(-2.0 * (0.3 * math.pi) ** 2)),
        (q, 0.0),
    ):
        values: dict[str, object] = {"gyro.resolution": q, "gyro.white": white, "gyro.bandwidth": 50.0}
        _, result = reduced("fixed_position", "gyro_mems", {**values, "dwell": 60.0, "readings": 10})
        lines = {b.source: b.contribution for b in result.budget}
        assert lines.get("word of the gyro", 0.0) == pytest.approx(u, rel=0.01, abs=1e-6)


def test_a_gyro_that_answers_nothing_has_a_doubt() -> None:
    """A ring laser without dither, locked within 0.05 deg/s, reads zero at rest: no noise, u = 0, its bias hidden."""
    values: dict[str, object] = {"gyro.dither": 0.0, "gyro.bias": [3.0 * DPH, 0.0], "dwell": 60.0, "readings": 10}
    _, result = reduced("fixed_position", "gyro_laser", values)
    assert result["ω_d"].u == 0.0
    assert "noise.none" in {r.id for r in result.reasons if r.severity == "doubt"}


def test_a_dither_in_the_output_folds_into_the_mean() -> None:
    """A dither of 384 Hz put the drift off by 12 U, the residuals ordinary; taken off, it is in no sample."""
    for stripped in (0.0, 1.0):
        values: dict[str, object] = {"dwell": 60.0, "readings": 10, "gyro.stripped": stripped}
        _, result = reduced("fixed_position", "gyro_laser", values)
        assert ("gyro.dithered" in {r.id for r in result.reasons}) == (stripped == 0.0)


def test_a_dead_band_that_hides_the_earth_rate_is_said() -> None:
    """Axis x up and down: a dead band of 0.01 deg/s = 36 deg/h reads none of W sin(45.75 deg) = 10.77 deg/h, and G is
    off by that per g; axis z up, x east, there is nothing to answer.
    """
    short: dict[str, object] = {
        "levels": "0 1 2", "readings": 2, "window": 1.0, "gyro.dead_band": 36.0 * DPH, "gyro.g": [[0.0] * 3] * 2,
    }  # fmt: skip
    for axis in "xz":
        _, result = reduced("vibration_rectification", "gyro_fog", {**short, "axis": axis})
        said = [r.text for r in result.reasons if r.id == "gyro.unanswered"]
        assert [("±36 °/h" in t) for t in said] == [True] * (axis == "x")
        assert abs(result["G"].estimate) == pytest.approx(10.77 if axis == "x" else 0.0, abs=0.3)


def test_a_word_hides_the_g_sensitivity() -> None:
    """Words of 0.36 deg/s, hardly noise: three levels up and three down, each off by 1296/sqrt(12) deg/h rms, and G is
    half the difference of their means, G2 the slope over s2 = 0, 1, 4 g2 of all six.
    """
    values: dict[str, object] = {
        "levels": "0 1 2", "readings": 2, "window": 1.0, "gyro.resolution": 1296.0 * DPH, "gyro.white": 1e-9,
    }  # fmt: skip
    _, result = reduced("vibration_rectification", "gyro_mems", values)
    off = 1296.0 / math.sqrt(12.0)
    square = np.array([0.0, 1.0, 4.0] * 2)
    assert result["G"].u == pytest.approx(off / math.sqrt(6.0), rel=0.01)
    assert result["G2"].u == pytest.approx(off / math.sqrt(float(np.sum((square - square.mean()) ** 2))), rel=0.02)


def test_a_whole_angle_gyro_at_rest_is_at_one_angle_of_its_pattern() -> None:
    short: dict[str, dict[str, object]] = {
        "fixed_position": {"dwell": 60.0, "readings": 10},
        "turn_on_repeatability": {"days": 1, "turn_ons": 3, "dwell": 60.0, "window": 5.0},
        "vibration_rectification": {"levels": "0 1 2", "readings": 2, "window": 1.0},
    }
    for part, name in ((p, n) for p in ("gyro_hemispherical", "gyro_fog") for n in short):
        _, result = reduced(name, part, short[name])
        assert ("gyro.pattern" in {r.id for r in result.reasons}) == (part == "gyro_hemispherical")


def test_the_compass_has_the_digits_of_its_uncertainty() -> None:
    """U of some degrees: the heading to a degree, or to a tenth below 10 deg; it was said to 0.001."""
    _, result = reduced("north_finder", "gyro_mems", {"gyro.white": 0.2 * DPH * 60.0, "heading": 0.7})
    psi, said = result["ψ"], result.summary[0]
    decimals = max(0, 1 - math.floor(math.log10(psi.k * psi.u)))
    assert psi.k * psi.u > 1.0
    assert said.endswith(f"on the compass {psi.estimate % 360.0:.{decimals}f}°.")


def test_g_sensitivity_reaches_the_rate() -> None:
    """Axis up, f = g: 1e-6 s/m of 9.8 m/s2 are 2 deg/h more."""
    values: dict[str, object] = {
        "attitude": "U E", "gyro.g": [[1e-6, 0.0, 0.0], [0.0, 0.0, 0.0]], "dwell": 60.0, "readings": 10,
        "gyro.white": 0.0, "gravity": 9.81,
    }  # fmt: skip
    _, result = reduced("fixed_position", "gyro_mems", values)
    assert result.coefficients[0].estimate == pytest.approx(-9.81e-6 / DPH, rel=1e-9)


def test_a_measured_file_of_rates(tmp_path: Path) -> None:
    file = tmp_path / "rates.csv"
    rng = np.random.default_rng(2)
    rows = [f"{60 * k},{60 * (k + 1)},{x:.9f}" for k, x in enumerate(7.0 + 0.1 * rng.normal(size=30))]
    head = ["# latitude = 30deg", "# attitude = U E", "# reading = rate", "t_start [s],t_end [s],mean [deg/h]"]
    file.write_text("\n".join([*head, *rows]) + "\n", encoding="utf-8")
    system = load_system("fixed_position").with_values({})
    result = system.reduce(system.read_measured(file, {}))
    earth = frames.EARTH_RATE * 0.5 / DPH
    assert result.coefficients[0].estimate == pytest.approx(earth - 7.0, abs=0.1)


@pytest.mark.parametrize(
    ("values", "said"),
    [({"reading": "voltage"}, "must be current or rate"), ({"reading": "rate", "k": "1deg/h/mA"}, "of a torquer")],
)
def test_refused(values: dict[str, object], said: str) -> None:
    system = load_system("fixed_position").with_values(values)
    with pytest.raises(InvalidConfigurationError, match=said):
        system.refuse()


def test_back_to_the_current() -> None:
    system = load_system("fixed_position")
    system.set("reading", "rate")
    system.request("surroundings")
    system.set("reading", "current")
    assert "rebalance" in system.slots and "surroundings" in system.slots and "gyro.i" not in system.open


@pytest.mark.parametrize("part", ["gyro_fog", "gyro_mems", "gyro_vibratory"])
def test_north_finder_takes_them(part: str) -> None:
    """Without noise the heading that is put in; with it the density must be known."""
    quiet = {"gyro.optical": 0.0} if part == "gyro_fog" else {"gyro.white": 0.0}
    system = load_system("north_finder").with_values({})
    with Session(system, {"gyro": part}) as session:
        if part == "gyro_fog":
            with pytest.raises(InvalidConfigurationError, match="density unknown"):
                session.run({"time": 60.0})
        still = {f"accelerometers.white_{a}": 0.0 for a in "xyz"}
        record = session.run({"time": 60.0, "density": 1e-9, **quiet, **still})
    result = system.with_values(record.run.options).reduce(record)
    assert result.coefficients[0].estimate == pytest.approx(40.0, abs=0.01)


@pytest.mark.parametrize("name", ["drift_record", "north_finder"])
@pytest.mark.long
def test_an_archive_holds_the_rate_gyro(name: str, tmp_path: Path) -> None:
    """Export of the system as its parts make it, and the same system again from the archive."""
    system = load_system(name).with_values({"density": 1e-6} if name == "north_finder" else {})
    export_ssp(system, tmp_path / "x.ssp", {"gyro": "gyro_fog"})
    again = read_ssp(tmp_path / "x.ssp")
    assert again.wires.count("gyro.f[1]") <= 1 and "rebalance" not in again.slots


def test_a_rate_of_the_other_sign_is_named(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    rate = 7.0 + 0.1 * rng.normal(size=30)
    rate[4:6] *= -1.0
    rows = [f"{60 * k},{60 * (k + 1)},{x:.9f}" for k, x in enumerate(rate)]
    head = ["# latitude = 30deg", "# attitude = U E", "# reading = rate", "t_start [s],t_end [s],mean [deg/h]"]
    file = tmp_path / "rates.csv"
    file.write_text("\n".join([*head, *rows]) + "\n", encoding="utf-8")
    system = load_system("fixed_position").with_values({})
    said = " ".join(r.text for r in system.reduce(system.read_measured(file, {})).reasons)
    assert "the rate of the opposite sign in rows 5 to 6" in said
