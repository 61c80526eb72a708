from __future__ import annotations

import math

import pytest

from gyrobench.reduction.estimation.verdict import conclude
from gyrobench.report import SpecificationError, check_units, content_dir, load_specification
from gyrobench.result import Coefficient, LoopResult
from gyrobench.units import UnitError

GOOD = '[coefficients.D_I]\nunit = "deg/h/g"\nmin = -1.5\nmax = 1\n[coefficients.D_F]\nunit = "°/h"\nmax = 0.5\n'


def write(folder, text):
    path = folder / "spec.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_limits_in_surface_units(tmp_path):
    limits = load_specification(write(tmp_path, GOOD))
    assert limits == {"D_I": (-1.5, 1.0), "D_F": (None, 0.5)}


def test_the_standard_example_loads():
    limits = load_specification(content_dir() / "specs" / "floated_gyro.toml")
    assert set(limits) == {"D_F", "D_I", "D_O", "D_S", "D_II", "D_SS", "D_IO", "D_IS", "D_OS"}
    assert all(low < 0.0 < high for low, high in limits.values())


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("coefficients = [", "not a TOML file"),
        ("", r"no \[coefficients.NAME\] table"),
        ("limits = 1", "unknown key 'limits'"),
        ("[coefficients]\nD_I = 3", "must be a table"),
        ("[coefficients.D_I]\nmin = 1.0", "unit is missing"),
        ('[coefficients.D_I]\nunit = "°/h"', "neither min nor max"),
        ('[coefficients.D_I]\nunit = "°/h"\nmin = nan', "min must be a finite number"),
        ('[coefficients.D_I]\nunit = "°/h"\nmax = "1"', "max must be a finite number"),
        ('[coefficients.D_I]\nunit = "°/h"\nmax = true', "max must be a finite number"),
        ('[coefficients.D_I]\nunit = "°/h"\nmin = 2\nmax = 1', "is not below max"),
        ('[coefficients.D_I]\nunit = "°/h"\nlow = 2', "unknown key 'low'"),
    ],
)
def test_refusals_say_where_and_what(text, message, tmp_path):
    path = write(tmp_path, text)
    with pytest.raises(SpecificationError, match=message) as caught:
        load_specification(path)
    assert str(path) in str(caught.value)


def test_units_and_names_must_be_those_of_the_report(tmp_path):
    path = write(tmp_path, GOOD)
    check_units(path, {"D_I": "°/h/g", "D_F": "°/h", "D_O": "°/h/g"})
    with pytest.raises(SpecificationError, match="the report uses '°/h/g²'"):
        check_units(path, {"D_I": "°/h/g²", "D_F": "°/h"})
    with pytest.raises(SpecificationError, match="no coefficient 'D_F' in this result; there are D_I"):
        check_units(path, {"D_I": "°/h/g"})


@pytest.mark.parametrize(
    ("unit", "report", "factor"),
    [
        ("µrad", "″", 648000.0 / math.pi * 1e-6),  # 1 µrad = 0.206″
        ("deg/h/mA", "°/h/mA", 1.0),
        ("dps", "°/h", 3600.0),
        ("deg/sqrt(h)", "°/√h", 1.0),
        ("µrad/s/g", "°/h/g", 648000.0 / math.pi * 1e-6),
        ("odd", "odd", 1.0),  # the unit of the report itself, whatever it is
    ],
)
def test_limits_are_converted_by_dimension(unit, report, factor, tmp_path):
    """A coefficient of 1.5 ± 0.1 (unit of the file) against 1 to 2 passes, against 1 to 1.55 is inconclusive."""
    estimate = 1.5 * factor
    c = Coefficient("D", "", report, estimate, 0.05 * factor, 2.0, (1.4 * factor, 1.6 * factor))
    verdicts = {}
    for high in (2, 1.55):
        path = write(tmp_path, f'[coefficients.D]\nunit = "{unit}"\nmin = 1\nmax = {high}\n')
        limits = load_specification(path)
        check_units(path, {"D": report})
        judged = conclude(
            LoopResult(method="", sources=[], conventions=[], responses=[], coefficients=[c]), limits=limits
        ).coefficients[0]
        assert judged.limit == pytest.approx((factor, high * factor))
        verdicts[high] = judged.verdict
    assert verdicts == {2: "pass", 1.55: "inconclusive"}


def test_unit_of_another_dimension_is_refused_when_it_is_judged(tmp_path):
    limits = load_specification(write(tmp_path, '[coefficients.D]\nunit = "mA"\nmax = 1\n'))
    c = Coefficient("D", "", "°/h", 0.5, 0.1, 2.0, (0.3, 0.7))
    with pytest.raises(UnitError, match="D is given in 'mA'; the report uses '°/h', which is of another kind"):
        conclude(LoopResult(method="", sources=[], conventions=[], responses=[], coefficients=[c]), limits=limits)
