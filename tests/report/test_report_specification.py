from __future__ import annotations

import pytest

from gyrobench.report import SpecificationError, check_units, content_dir, load_specification

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
