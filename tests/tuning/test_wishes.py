"""Wishes and spreads as a person writes them, and what is refused with which words."""

from __future__ import annotations

import math

import pytest

from gyrobench.bench import UsageError
from gyrobench.tuning.spread import parse_spread, points
from gyrobench.tuning.structures import ControllerStructure
from gyrobench.tuning.tuned_loop import range_text, where
from gyrobench.tuning.wishes import parse_wishes, with_margin

FAST = "bandwidth>20Hz"


@pytest.mark.parametrize(
    ("text", "value", "least"),
    [
        ("phase margin=40deg", math.radians(40.0), True),
        ("gain margin = 6dB", 10.0**0.3, True),
        ("gain margin>=2", 2.0, True),
        ("disk margin=0.5", 0.5, True),
        ("delay  margin>2ms", 2e-3, True),
        ("bandwidth>0.02kHz", 20.0, True),
        ("peak S<6dB", 10.0**0.3, False),
        ("S at 500mHz<-40dB", 0.01, False),
    ],
)
def test_a_wish(text: str, value: float, least: bool) -> None:
    wish = next(w for w in parse_wishes([text, "S at 7Hz<-3dB"]) if w.f != 7.0)
    assert (wish.value, wish.least) == (pytest.approx(value, rel=1e-12), least)
    assert wish.f == (0.5 if "500" in text else 0.0)
    # fulfilled just so; twice as good counts 2, whatever the direction
    assert wish.ratio(wish.value) == 1.0
    assert wish.ratio(2.0 * wish.value if least else 0.5 * wish.value) == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        ([], "nothing is wanted"),
        (["phase margin=40deg"], "margins are largest in a loop that does nothing"),
        (["phase margins=40deg", FAST], "no measure 'phase margins'; did you mean phase margin"),
        (["phase margin", FAST], "write MEASURE=VALUE"),
        (["phase margin=40Hz", FAST], "does not convert to 'rad'"),
        (["phase margin=40", FAST], "must be below 180deg; a number without unit is in rad"),
        (["phase margin<40deg", FAST], "of phase margin more is better; write > or ="),
        (["peak S>6dB", FAST], "of peak S less is better; write < or ="),
        (["gain margin=0dB", FAST], "must be above 0 dB"),
        (["gain margin=6 dBm", FAST], "a factor, or dB, is expected"),
        (["disk margin=2", FAST], "is below 2 in every loop"),
        (["bandwidth=-3Hz"], "must be above 0"),
        ([FAST, "bandwidth=3Hz"], "bandwidth: given twice"),
        (["S at 1kg<-40dB"], "does not convert to 'Hz'"),
    ],
)
def test_wishes_refused(texts: list[str], message: str) -> None:
    with pytest.raises(UsageError, match=message):
        parse_wishes(texts)


def known(name: str) -> tuple[float, str]:
    return {"platform.J": (2.0, "kg.m2"), "mode.f": (264.0, "1/s"), "base.x": (0.0, "m")}[name]


def test_a_spread_and_its_points() -> None:
    """Nominal, 2^2 corners, 7 points inside; +-30 % of 2 kg m2 is 1.4 to 2.6."""
    ranges = parse_spread(["platform.J=±30%", "mode.f=38..46Hz"], known)
    assert [(r.low, r.high) for r in ranges] == [(pytest.approx(1.4), pytest.approx(2.6)), (38.0, 46.0)]
    found = points(ranges)
    assert found[0] == {} and len(found) == 1 + 4 + 7
    assert {tuple(p.values()) for p in found[1:5]} == {(a, b) for a in (1.4, 2.6) for b in (38.0, 46.0)}
    assert all(1.4 < p["platform.J"] < 2.6 and 38.0 < p["mode.f"] < 46.0 for p in found[5:])
    (spread,) = parse_spread(["platform.J=+-0.5kg.m2"], known)
    assert spread.low == 1.5 and range_text(spread) == "platform.J 1.5 kg·m² to 2.5 kg·m²"
    assert where({"platform.J": spread.low}, (spread,)) == "platform.J = 1.5 kg·m²", "written alike"
    assert points([]) == [{}]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("platform.J", "write PART.PARAM=±30%"),
        ("platform.J=3kg.m2", "write ±30% or LOW..HIGH"),
        ("platform.J=3..1kg.m2", "the first value must be the smaller one"),
        ("platform.J=±0%", "the spread must be > 0"),
        ("platform.J=±3N", "does not convert"),
        ("base.x=±10%", "the nominal value is 0"),
    ],
)
def test_spreads_refused(text: str, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        parse_spread([text], known)
    with pytest.raises(UsageError, match="given twice"):
        parse_spread(["platform.J=±30%", "platform.J=±10%"], known)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("pid", "no factor 'pid'"),
        ("pi+pi", "pi stands in it twice"),
        ("notch+notch+notch+notch+lead", "of order 9; 8 is the highest"),
    ],
)
def test_structures_refused(name: str, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        ControllerStructure(name)


def test_a_loop_without_a_margin_gets_one() -> None:
    wishes, notes = with_margin(parse_wishes(["bandwidth>20Hz"]))
    assert [str(w) for w in wishes] == ["bandwidth at least 20 Hz", "peak S at most 6 dB"] and len(notes) == 1
    assert with_margin(wishes) == (wishes, [])


def test_a_value_is_rounded_to_its_uncertainty() -> None:
    """A gain of 3.55 ± 0.055 is 11.005 dB, and 20 lg(3.605/3.55) = 0.134 dB more at its upper end."""
    margin, phase, _ = parse_wishes(["gain margin=6dB", "phase margin=40deg", FAST])
    assert margin.shown(3.55, 0.055) == "11.00 dB ± 0.13 dB" and margin.shown(3.55) == "11 dB"
    assert phase.shown(math.radians(41.26), math.radians(12.0)) == "41° ± 12°"
