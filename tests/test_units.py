"""Units: factors by hand, dimensions, refusals that help."""

from __future__ import annotations

import math

import pytest

from gyrobench import units
from gyrobench.units import UnitError, base_unit, convert, display, fitting, parse_quantity, unit

DEG = math.pi / 180


@pytest.mark.parametrize(
    ("name", "factor"),
    [
        ("rad/s/A", 1.0),
        ("N.m.s", 1.0),
        ("kg.m2", 1.0),
        ("V/rad", 1.0),
        ("1", 1.0),
        ("K/m", 1.0),
        ("N.m.s/rad", 1.0),
        ("deg/h", DEG / 3600),
        ("deg/h/mA", DEG / 3600 / 1e-3),
        ("deg/h/g2", DEG / 3600 / 9.80665**2),
        ("°/h/g²", DEG / 3600 / 9.80665**2),
        ("arcsec", DEG / 3600),
        ("arcsec/s", DEG / 3600),
        ("%", 0.01),
        ("ERU", 7.2921159e-5),
        ("g.cm", 9.80665e-5),
        ("g.cm2/s", 1e-7),
        ("rad/s/sqrt(Hz)", 1.0),
        ("deg/sqrt(h)", DEG / 60),
        ("A/(V.s)", 1.0),
        ("A/V/s", 1.0),
        ("ug", 9.80665e-6),
        ("µg", 9.80665e-6),
        ("mg", 9.80665e-3),
        ("dps", DEG),
        ("mdps/√Hz", DEG * 1e-3),
        ("º/sec", DEG),
        ("deg/hr", DEG / 3600),
        ("°/√h", DEG / 60),
        ("µrad", 1e-6),
    ],
)
def test_factor(name: str, factor: float) -> None:
    assert unit(name).factor == pytest.approx(factor, rel=1e-15)


def test_one_arcsec_per_second_is_one_degree_per_hour() -> None:
    assert convert(1.0, "arcsec/s", "deg/h") == pytest.approx(1.0, rel=1e-15)
    assert convert(1.0, "deg/h", "rad/s") == pytest.approx(4.8481368e-6, rel=1e-8)  # CONV-FRAMES


def test_earth_rate() -> None:
    assert convert(1.0, "ERU", "deg/h") == pytest.approx(15.041, abs=1e-3)
    assert convert(1.0, "mERU", "deg/h") == pytest.approx(0.015041, abs=1e-6)  # E1: not 0.01541


@pytest.mark.parametrize(
    ("text", "to", "value"),
    [
        ("45.75deg", "rad", 45.75 * DEG),
        ("0.3deg/h", "rad/s", 0.3 * DEG / 3600),
        ("2mA", "A", 2e-3),
        ("2e-3", "A", 2e-3),
        (" -1.5e1 arcsec ", "rad", -15 * DEG / 3600),
        ("20degC", "K", 293.15),
        ("5%", "1", 0.05),
        ("0.5", "rad", 0.5),
        ("0.9°/h/g", "rad/s/g", 0.9 * DEG / 3600),
    ],
)
def test_parse(text: str, to: str, value: float) -> None:
    assert parse_quantity(text, to) == pytest.approx(value, rel=1e-14)


def test_plain_number_is_si_even_for_a_surface_target() -> None:
    assert parse_quantity("1.0", "deg") == pytest.approx(180 / math.pi)


def test_per_g0_coefficients() -> None:
    """X is in multiples of g0, so 'per g' and 'per g2' are no dimension for a coefficient kept in rad/s."""
    assert parse_quantity("0.9deg/h/g", "rad/s", per_g0=True) == pytest.approx(0.9 * DEG / 3600, rel=1e-14)
    assert parse_quantity("0.9deg/h/g2", "rad/s", per_g0=True) == pytest.approx(0.9 * DEG / 3600, rel=1e-14)
    assert parse_quantity("0.9deg/h", "rad/s", per_g0=True) == pytest.approx(0.9 * DEG / 3600, rel=1e-14)
    with pytest.raises(UnitError, match="does not convert"):
        parse_quantity("0.9deg/h/g", "rad/s")
    with pytest.raises(UnitError, match="does not convert"):
        parse_quantity("0.9mA", "rad/s", per_g0=True)


@pytest.mark.parametrize(
    ("text", "to", "message"),
    [
        ("2mA", "rad", "'mA' .A. does not convert to 'rad'.*units that fit: rad, mrad, urad, deg, arcmin, arcsec"),
        ("2Hz", "rad/s", "does not convert"),
        ("2furlong", "m", "unknown symbol 'furlong'"),
        ("abc", "1", "finite number"),
        ("nan", "1", "finite number"),
        ("inf", "1", "finite number"),
        ("", "1", "finite number"),
        ("1e999", "1", "finite"),
        ("3hz", "Hz", "did you mean Hz"),
        ("3rad//s", "rad/s", "unknown symbol '/'"),
        ("1.001 g0", "m/s2", "power 0 of .g.; g is the standard acceleration g0"),
        ("3 rad/s)", "rad/s", "out of place"),
        ("3sqrt(Hz", "Hz", "is missing"),
        ("3degC/m", "K/m", "stands alone"),
        ("3 1/", "Hz", "missing at the end"),
    ],
)
def test_refusals_say_what_fits(text: str, to: str, message: str) -> None:
    with pytest.raises(UnitError, match=message):
        parse_quantity(text, to)


def test_base_unit_for_fmi() -> None:
    assert base_unit("N.m.s") == ({"kg": 1, "m": 2, "s": -1}, 1.0)
    assert base_unit("rad/s") == ({"s": -1, "rad": 1}, 1.0)
    exponents, factor = base_unit("deg/h/mA") or ({}, 0.0)
    assert exponents == {"s": -1, "A": -1, "rad": 1}
    assert factor == pytest.approx(DEG / 3.6)
    assert base_unit("1") == ({}, 1.0)
    assert base_unit("rad/s/sqrt(Hz)") is None  # half powers: FMI's exponents are integers
    assert base_unit("rad2/s2/Hz") == ({"s": -1, "rad": 2}, 1.0)


def test_display() -> None:
    assert [display(n) for n in ("deg/h", "deg/h/g", "deg/h/g2", "arcsec", "rad/s/sqrt(Hz)", "kg.m2", "ug", "1")] == [
        "°/h",
        "°/h/g",
        "°/h/g²",
        "″",
        "rad/s/√Hz",
        "kg·m²",
        "µg",
        "1",
    ]


def test_every_symbol_reads_its_own_printed_form() -> None:
    for name in units._TABLE:
        assert unit(display(name)).factor == unit(name).factor, name
    for name in ("deg/h/g2", "rad/s/sqrt(Hz)", "N.m.s/rad"):
        assert unit(display(name)).exponents == unit(name).exponents


def test_times_and_frequencies_of_electronics() -> None:
    assert units.parse_quantity("20ns", "s") == pytest.approx(2e-8, rel=1e-15)
    assert units.parse_quantity("10MHz", "Hz") == 1e7 and units.parse_quantity("10mHz", "Hz") == 0.01


@pytest.mark.parametrize(
    ("text", "said"),
    [("1,5deg/h", "did you mean 1.5deg/h?"), ("-0,25", "did you mean -0.25?"), ("1.000,5deg/h", "is a point")],
)
def test_a_decimal_comma_is_named(text: str, said: str) -> None:
    with pytest.raises(UnitError, match=r"a comma \(,\d+\)") as error:
        parse_quantity(text, "rad/s")
    assert str(error.value).endswith(said)


def test_units_that_fit_are_written_as_the_trade_writes_them() -> None:
    assert fitting("kg.m2") == ("kg.m2", "g.cm2")
    assert fitting("N/m") == ("kg/s2", "N/m", "N/um")
    assert "deg/h/g" in fitting("°/h/g") and "deg/h/g2" in fitting("°/h/g2") and "deg/sqrt(h)" in fitting("°/√h")
