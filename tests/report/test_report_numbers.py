from __future__ import annotations

import math
import re

import pytest

from gyrobench.report import plots
from gyrobench.report.numbers import decimals, write_number, write_p
from gyrobench.report.tables import method_table
from gyrobench.result import Table


@pytest.mark.parametrize(
    ("u", "digits"),
    [(0.0021, 4), (0.012, 3), (1.0, 1), (0.996, 1), (0.0996, 2), (9.96, 0), (12.0, 0), (340.0, -1), (1e-7, 8)],
)
def test_decimals_show_two_digits_of_u(u, digits):
    # 0.0996 rounds to 0.10: two decimals, not three
    assert decimals(u) == digits


@pytest.mark.parametrize(
    ("value", "u", "text"),
    [
        (0.89904425, 0.00208796, "0.8990"),
        (-0.7014704, 0.0021, "−0.7015"),
        (12.3456, 0.34, "12.35"),
        (12.3456, 3.4, "12.3"),
        (1234.5, 12.0, "1234"),  # ties go to even, as Python's round does
        (1236.0, 340.0, "1240"),
        (-0.00004, 0.012, "0.000"),  # no negative zero
        (2.9e-9, 1.0e-10, "2.90·10⁻⁹"),
        (0.5, None, "0.5"),
        (1.0, None, "1"),
        (0.0, None, "0"),
        (9.80665, None, "9.807"),
        (1e-7, None, "1·10⁻⁷"),
        (6378137.0, None, "6.378·10⁶"),
        (0.5, 0.0, "0.5"),  # an uncertainty of zero says nothing about digits
        (0.5, math.nan, "0.5"),
        (7, 0.1, "7"),
        (0.0499916, 9.3e-6, "0.0499916"),  # nine decimals from 0.01 on
        (0.00499916, 9.3e-8, "4.999160·10⁻³"),
    ],
)
def test_written(value, u, text):
    assert write_number(value, u).text == text


@pytest.mark.parametrize("value", [None, math.nan, math.inf, -math.inf])
def test_no_number_is_a_dash(value):
    written = write_number(value)
    assert written.text == "–"
    assert written.full == ""


def test_the_full_value_comes_back_exactly():
    for value in (0.1 + 0.2, 1e-300, -7.2921159e-5, 123456789.123456789):
        assert float(write_number(value, 0.01).full) == value


def test_cut_at_the_decimal_sign():
    written = write_number(-12.345, 0.011)
    assert (written.whole, written.rest) == ("−12", ".345")


def test_p_values():
    assert write_p(0.0499).text == "0.050"
    assert write_p(1e-9).text == "< 0.001"
    assert float(write_p(1e-9).full) == 1e-9
    assert write_p(None).text == "–"


def test_a_probability_is_not_rounded_to_the_u_of_its_row() -> None:
    """u = 41 rounds an estimate of -35.9 to -36, but not the probability 0.513 to 1, nor a change of 0.84 u."""
    heads = ["candidate", "estimate", "u", "probability", "largest change", "of u"]
    table = Table("nuisances", "Nuisance model", "", heads, [["K2_y", -35.9, 40.9, 0.5134, "ba_y", 0.84009]])
    document = {"tables": [{"rows": table.rows}]}
    (block,) = method_table(document, ("tables", 0), table)
    assert [c.text for c in block.rows[0].cells] == ["K2_y", "−36", "41", "0.513", "ba_y", "0.84"]


def test_lags_are_whole_windows() -> None:
    """Three lags have the ticks 0, 1, 2, and none between them: zoomed figures carry the tick in its group."""
    drawn = plots.acf([0.0, 1.0, 2.0], [1.0, -0.3, -0.1], [0.2, 0.2, 0.2], "acf")
    assert len(re.findall(r'id="[^"]*xtick_\d+"', drawn)) == 3
