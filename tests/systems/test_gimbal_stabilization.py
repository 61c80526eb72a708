"""The stabilized line of sight: jitter against its linear budget, margins, both forms, friction, keyhole, refusals."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
from support.gimbal_rides import ridden, rows

from gyrobench.reduction.estimation.allowance import BEYOND
from gyrobench.reduction.loops.margins import excitation_response
from gyrobench.system.configurable import InvalidConfigurationError
from gyrobench.system.system import load_system


@pytest.fixture(scope="module")
def quiet() -> Any:
    return ridden(ride=60.0)[0]


@pytest.mark.long
def test_jitter_is_that_of_the_linear_model(quiet: Any) -> None:
    """Without dry friction the budget is in the interval of the co-simulation, widened by 2 %; the gyro rules."""
    for name in ("jitter pitch", "jitter yaw", "jitter"):
        c = quiet[name]
        assert abs(c.estimate - c.closed) < c.k * c.u + 0.02 * c.closed
    found = rows(quiet)
    assert 80.0 < found["noise of the gyro"][2] < 95.0
    assert sum(r[2] for n, r in found.items() if r[2] is not None) == pytest.approx(100.0)
    assert quiet.reasons == [r for r in quiet.reasons if r.id != "budget.not_linear"]


@pytest.mark.long
def test_a_largest_angle_has_the_random_walk_of_the_gyro() -> None:
    """0.005 deg/s/sqrt(Hz), one-sided: after the second of the load 8.727e-5 sqrt(1/2) = 61.7 µrad; the rests of the
    load, half a second each, show a third of it.
    """
    walk = math.radians(0.005) * math.sqrt(0.5) * 1e6
    result, _ = ridden(psd="none", load_step=0.05, ride=60.0)
    for name in ("peak pitch", "peak yaw"):
        assert 0.75 * walk < result[name].u < 1.4 * walk


@pytest.mark.long
def test_noise_of_the_gyro_by_hand() -> None:
    """No vibration: with |T| about 1 below the crossover, rms of n/(2 pi f) from 1 Hz on, peaked by the loop.

    0.005 deg/s/sqrt(Hz) over w from 1 to 3 Hz: 8.727e-5 / (2 pi) sqrt(1 - 1/3) = 11.34 µrad, times T between 1 and
    1.25 there.
    """
    result, _ = ridden(psd="none")
    table = next(t for t in result.tables if t.id == "jitter.bands")
    low = math.radians(0.005) / (2 * math.pi) * math.sqrt(1 - 1 / 3) * 1e6
    assert low < table.rows[0][3] < 1.25 * low
    assert list(rows(result)) == ["noise of the gyro", "together", "co-simulated"]
    assert result["jitter"].estimate == pytest.approx(result["jitter"].closed, rel=0.08)


@pytest.mark.parametrize(
    "friction",
    [{"stiction": 0.05}, {"stiction": 0.02, "pitch": 0.6}, {"stiction": 0.02, "form": "pitch-yaw", "yaw": -0.5}],
)
@pytest.mark.long
def test_slipping_joints_have_a_budget(friction: dict[str, Any]) -> None:
    """Dry friction rules the jitter; the torque that the joint angles make explains it within 6 %."""
    result, _ = ridden(**friction)
    assert result["jitter"].estimate == pytest.approx(result["jitter"].closed, rel=0.06)
    assert rows(result)["dry friction"][2] > 30.0


@pytest.mark.long
def test_cogging_and_cables_have_a_budget() -> None:
    given = {f"platform.cogging[{k}]": 0.02 for k in (1, 2)} | {f"platform.cable[{k}]": 0.3 for k in (1, 2)}
    result, _ = ridden(given, gyro_noise=0.0)
    assert result["jitter"].estimate == pytest.approx(result["jitter"].closed, rel=0.06)
    found = rows(result)
    assert found["cogging"][2] > 30.0


@pytest.mark.long
def test_unbalance_and_acceleration_have_a_budget() -> None:
    """The truck's acceleration on 2e-3 kg.m of the inner gimbal along z."""
    result, _ = ridden({"platform.unbalance[2,3]": 2e-3}, psd="truck", gyro_noise=0.0, jitter_from=10.0, ride=30.0)
    assert result["jitter"].estimate == pytest.approx(result["jitter"].closed, rel=0.1)
    assert rows(result)["acceleration by unbalance"][2] == pytest.approx(100.0)


def with_limit(record: Any, wanted: float) -> dict[str, Any]:
    """Return what the allowance of each quantity is for a jitter, µrad."""
    result = load_system("gimbal_stabilization").reduce(record, {"jitter": (None, wanted)})
    return {row[2]: row[4] for t in result.tables if t.id == "budget.allowance:jitter" for row in t.rows}


@pytest.mark.parametrize(
    ("quantity", "share", "options"),
    [
        ("gyro_noise", 1.5, {}),
        ("psd_scale", 0.7, {"pitch": 0.35}),  # a roll times joint angle, too
        ("platform.unbalance", 0.6, {"psd": "truck", "jitter_from": 10.0, "platform.unbalance[2,3]": 2e-3}),
    ],
)
@pytest.mark.long
def test_a_source_at_its_allowance_gives_the_jitter_that_was_wanted(quantity: str, share: float, options: Any) -> None:
    """The budget of a new ride within 0.1 %, its co-simulation within 5 %."""
    values = {n: options.pop(n) for n in list(options) if "." in n}
    result, record = ridden(values, ride=36.0, **options)
    wanted = share * result["jitter"].closed
    most = with_limit(record, wanted)[quantity]
    match quantity:
        case "gyro_noise":
            options["gyro_noise"] = math.radians(most)
        case "platform.unbalance":
            values["platform.unbalance[2,3]"] = most
        case _:
            options[quantity] = most
    again, _ = ridden(values, ride=36.0, **options)
    assert again["jitter"].closed == pytest.approx(wanted, rel=1e-3)
    assert again["jitter"].estimate == pytest.approx(wanted, rel=0.05)


@pytest.mark.long
def test_a_coarse_gyro_is_named_as_what_the_budget_lacks() -> None:
    """Steps of 0.5 deg/s over noise of 0.053 deg/s rms: the line of sight wanders within one."""
    result, _ = ridden({"gyro.resolution": math.radians(0.5)}, ride=20.0, jitter_from=2.0)
    text = next(r.text for r in result.reasons if r.id == "budget.not_linear")
    assert "the steps of the gyro's output are larger than its noise" in text


@pytest.mark.long
def test_an_allowance_beyond_reach_is_said_in_words() -> None:
    """Dry friction alone makes more than a fifth of the jitter; where it slips, others are allowed twice as much."""
    _, record = ridden(ride=20.0, jitter_from=2.0, stiction=0.05)
    found = load_system("gimbal_stabilization").reduce(record)
    wanted = found["jitter"].closed
    assert str(with_limit(record, 0.2 * wanted)["gyro_noise"]).startswith("none suffices: ")
    found = with_limit(record, 1.3 * wanted)
    assert found["gyro_noise"] == BEYOND
    assert 0.05 < found["platform.stiction"] < 0.1


@pytest.mark.long
def test_the_swings_of_the_base_stand_above_the_noise() -> None:
    """The default sines: each isolation has a value, u of 2.5 dB at most, and is that of the linear model.

    White noise S at the tone gives u = sqrt(S/T) over its amplitude: 5.2 µrad/sqrt(Hz) and 18 µrad at 3 Hz, 16 s: 7 %.
    """
    result, record = ridden(base=math.radians(1.0), psd="none")
    model = record.run.linear.closed.discrete
    for k, axis, channel in ((1, "x", "platform.los[1]"), (3, "z", "platform.los[2]")):
        for f in (1.0, 3.0, 8.0):
            c = result[f"isolation {axis} {f:g} Hz"]
            assert c.no_value == "" and c.u < 2.5
            linear = 20.0 * math.log10(abs(excitation_response(model, "motion", k, channel, [f])[0]))
            assert c.estimate == pytest.approx(linear, abs=3.0 * c.u + 0.2)


@pytest.mark.long
def test_both_forms_are_one_gimbal() -> None:
    """Pitch-yaw with the inertias in its own axes, turned by 0.4: the jitters change places (other phases: 15 %)."""
    turned = {
        "platform.I_inner[1,1]": 0.045, "platform.I_inner[3,3]": 0.045,
        "vibration.rate_psd[1,1]": 0.0, "vibration.rate_psd[3,1]": 0.0,
    }  # fmt: skip
    first, _ = ridden(turned, psd="none", gyro_noise=0.0, form="yaw-pitch", pitch=0.4, load_step=0.05)
    second, _ = ridden(turned, psd="none", gyro_noise=0.0, form="pitch-yaw", yaw=0.4, load_step=0.05)
    assert first["peak pitch"].estimate == pytest.approx(second["peak yaw"].estimate, rel=1e-6)
    assert first["peak yaw"].estimate == pytest.approx(second["peak pitch"].estimate, rel=1e-6)


@pytest.mark.long
def test_margins_are_those_of_the_linear_model() -> None:
    """At 50 degrees of pitch the secant keeps the crossover of the outer loop where it was asked for."""
    result, _ = ridden(sweeps=True, psd="none", pitch=math.radians(50.0), gyro_noise=1e-6, ride=36.0)
    for axis in ("pitch", "yaw"):
        assert result[f"f_c {axis}"].estimate == pytest.approx(12.0, rel=0.01)
        assert result[f"PM {axis}"].estimate == pytest.approx(result[f"PM {axis}"].closed, abs=0.3)


@pytest.mark.long
def test_the_keyhole_is_said() -> None:
    result, _ = ridden(pitch=math.radians(80.0), psd="none", ride=36.0)
    text = " ".join(result.warnings)
    assert "in the keyhole" in text and "A limit was active in decoupler, in: " in text
    system: Any = load_system("gimbal_stabilization")
    system.set("pitch", math.radians(80.0))
    assert "keyhole" in system.warnings()[0]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"form": "roll-yaw"}, "must be one of yaw-pitch, pitch-yaw"),
        ({"crossover": 45.0}, "above the mode at 42 Hz"),
        ({"ride": 30.0}, "takes 36 s or more"),
        ({"psd": "tank"}, "psd = tank: none of vehicle"),
    ],
)
def test_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidConfigurationError, match=message):
        ridden(**options)


def test_spectra_beyond_the_steps_and_beyond_the_record(tmp_path: Path) -> None:
    """Steps of 0.2 ms carry up to 2500 Hz, a record every 1 ms up to 500 Hz."""
    file = tmp_path / "mast.csv"
    system: Any = load_system("gimbal_stabilization")
    system.set("psd", str(file))
    for top, refused, warned in ((400, 0, 0), (600, 0, 1), (3000, 1, 1)):
        file.write_text(f"frequency [Hz],rate_x [deg2/s2/Hz]\n2,0.01\n{top},0.01\n")
        assert (len(system.check()), len(system.warnings())) == (refused, warned)
    assert "reaches up to 3000 Hz, and steps of 0.0002 s carry up to 2500 Hz" in system.check()[0]


@pytest.mark.long
def test_a_file_with_spectra(tmp_path: Path) -> None:
    """Rates about x alone, 0.01 (deg/s)2/Hz from 2 to 8 Hz: no vibration about z in the budget."""
    file = tmp_path / "mast.csv"
    file.write_text("frequency [Hz],rate_x [deg2/s2/Hz]\n2,0.01\n8,0.01\n")
    result, record = ridden(psd=str(file), gyro_noise=0.0, ride=36.0)
    assert next(iter(rows(result))) == "motion of the base about x" and "motion of the base about z" not in rows(result)
    omega = record.channels["vibration.omega[1]"][-30000:]
    assert float((omega**2).mean()) == pytest.approx(math.radians(1.0) ** 2 * 0.06, rel=0.05)
