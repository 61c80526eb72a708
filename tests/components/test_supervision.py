"""Monitor of faults and supervisor of modes: each item and each interlock by itself, latches, refusals."""

from __future__ import annotations

import math
from typing import Any

import pytest
from wired import BENCH

from gyrobench.packaging.instance import InstanceError, Plain
from gyrobench.packaging.loading import load_part

FaultMonitor = load_part("fault_monitor", BENCH)
ModeSupervisor = load_part("mode_supervisor", BENCH)
H = 5e-4
PULSES = {"n": 0, "pulses": True, "wave": 0.05}  # 1 % of 5 V


def train(t: float, frequency: float = 50.0, duty: float = 0.5, amplitude: float = 5.0) -> float:
    return amplitude if math.modf(frequency * t + 1e-9)[0] < duty else 0.0


def watched(time: float, signals: Any, **values: Any) -> Plain:
    """Run the monitor; signals: time -> inputs."""
    made = Plain(FaultMonitor)
    made.set(values)
    made.set(signals(0.0))
    made.initialize(0.0)
    for k in range(round(time / H)):
        made.set(signals((k + 1) * H))
        made.step(k * H, H)
    return made


# ------------------------------------------------------------------------------------------- monitor
@pytest.mark.parametrize(
    ("fault", "first"),
    [
        ({}, 0),
        ({"frequency": 58.0}, 9),
        ({"frequency": 42.0}, 9),
        ({"duty": 0.62}, 10),
        ({"duty": 0.38}, 10),
        ({"amplitude": 6.0}, 11),
        ({"amplitude": 4.0}, 11),
        ({"amplitude": 0.0}, 9),  # lost: no frequency either
    ],
)
def test_eight_cases_of_a_pulse_train_with_noise_of_one_percent(fault: dict[str, float], first: int) -> None:
    made = watched(1.0, lambda t: {"pulse": train(t, **(fault if t > 0.47 else {}))}, seed=3, **PULSES)
    alarm, named, when, outside = made.get(["alarm", "first", "t_alarm", "outside"])
    assert [alarm, named] == [float(first > 0), first]
    if first:
        # the burst of the period from 0.5 s on is the first that has it, the second look ends with its period
        assert when == pytest.approx(0.7, abs=2 * H)
        assert outside == (3.0 if fault == {"amplitude": 0.0} else 1.0)


def test_features_of_the_train() -> None:
    made = watched(0.5, lambda t: {"pulse": train(t, 49.0, 0.48, 4.8)}, n=0, pulses=True)
    frequency, duty, amplitude = made.get(["frequency", "duty", "amplitude"])
    assert frequency == pytest.approx(49.0, rel=H / 0.02)  # one whole period, both ends to half a sample
    assert duty == pytest.approx(0.48, abs=2 * H * 49.0)  # whole samples
    assert amplitude == pytest.approx(4.8, rel=1e-12)


def test_all_scalars_within_and_the_first_of_two_outside() -> None:
    """Limits 0 to 1.  Items 7 and 3 leave at 0.25 s: 3 is named, both are counted; the excess is that of 1.3: 0.6."""
    limits = {"hold_off": 2}

    def signals(t: float) -> dict[str, float]:
        return {f"x[{j}]": 0.5 for j in range(1, 9)} | ({"x[7]": 1.3, "x[3]": -0.1} if t > 0.25 else {})

    made = watched(0.25, signals, **limits)
    assert made.get(["alarm", "first", "t_alarm", "outside"]) == [0.0, 0.0, -1.0, 0.0]
    assert made.get(["excess"])[0] == pytest.approx(-1.0)
    made = watched(0.6, signals, **limits)
    assert made.get(["alarm", "first", "outside"]) == [1.0, 3.0, 2.0]
    assert made.get(["t_alarm", "excess"]) == pytest.approx([0.5, 0.6], abs=2 * H)


def test_the_alarm_stays_until_the_reset_and_a_short_fault_is_none() -> None:
    inside = {f"x[{j}]": 0.5 for j in range(1, 9)}
    short = watched(1.0, lambda t: {**inside, "x[2]": 2.0 if 0.25 < t < 0.31 else 0.5})  # one look
    assert short.get(["alarm"]) == [0.0]

    def signals(t: float) -> dict[str, float]:
        return {**inside, "x[2]": 2.0 if 0.25 < t < 0.55 else 0.5, "clear": float(0.8 < t < 0.81)}

    assert watched(0.78, signals).get(["alarm", "first", "outside"]) == [1.0, 2.0, 0.0]
    assert watched(0.9, signals).get(["alarm", "first", "t_alarm"]) == [0.0, 0.0, -1.0]


def test_a_value_that_is_not_a_number_is_not_in_range() -> None:
    made = watched(0.1, lambda t: {f"x[{j}]": 0.5 for j in range(1, 9)})
    with pytest.raises(InstanceError, match=r"x\[4\]"):
        made.set({"x[4]": math.nan})
        made.step(0.1, H)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"low[2]": 1.0}, "range 2 is inverted or empty"),
        ({"duty_low": 0.6}, "duty_low must be below duty_high"),
        ({"pulses": True, "burst": 0.01}, "fewer than three edges"),
        ({"pulses": True, "frequency_high": 200.0}, "20 samples a period are needed"),
        ({"pulses": True, "period": 0.04}, "too few steps for 8 scalars and a burst"),
    ],
)
def test_refusals(values: dict[str, float], words: str) -> None:
    with pytest.raises(InstanceError, match=words):
        watched(2 * H, lambda t: {}, **values)


# ---------------------------------------------------------------------------------------- supervisor
class Console:
    """The supervisor with its inputs held, sampled at 100 Hz."""

    OUT = ("mode", "enable", "preset", "reason", "tripped")

    def __init__(self, **values: Any) -> None:
        self.part = Plain(ModeSupervisor)
        self.part.set(values)
        self.part.initialize(0.0)
        self.k = 0

    def after(self, samples: int = 1, **inputs: float) -> list[float]:
        """Return mode, enable, preset, reason, tripped after so many samples with new inputs."""
        requests = {f"request[{n[1]}]": v for n, v in inputs.items() if n[0] == "m" and n[1:].isdigit()}
        self.part.set(requests | {n: v for n, v in inputs.items() if f"request[{n[1:]}]" not in requests})
        for _ in range(samples):
            self.part.step(self.k * 0.01, 0.01)
            self.k += 1
        selected = self.part.get([f"select[{j}]" for j in range(1, 6)])
        out = self.part.get(list(self.OUT))
        assert sum(selected) == out[1] and (not out[1] or selected[int(out[0]) - 1] == 1.0)  # one source, the mode's
        return out


def test_a_request_is_followed_with_one_preset() -> None:
    console = Console()
    assert console.after(3) == [0, 0, 0, 0, 0]
    assert console.after(1, m2=1) == [2, 1, 1, 0, 0]
    assert console.after(1) == [2, 1, 0, 0, 0]
    assert console.after(1, m2=0, m3=1) == [3, 1, 1, 0, 0]
    assert console.after(1, m3=0) == [0, 0, 0, 0, 0]


def test_two_requests_are_not_followed() -> None:
    console = Console()
    assert console.after(1, m1=1, m5=1) == [0, 0, 0, 6, 0]
    assert console.after(1, m5=0) == [1, 1, 1, 0, 0]
    assert console.after(1, m2=1) == [1, 1, 0, 6, 0]  # the mode that is on stays


def test_a_change_at_speed_waits_for_the_stop_unless_it_is_bumpless() -> None:
    console = Console()
    console.after(1, m2=1)
    assert console.after(1, rate=0.5, m2=0, m3=1) == [2, 1, 0, 5, 0]
    assert console.after(1, rate=1e-4) == [3, 1, 1, 0, 0]
    other = Console(bumpless=True)
    other.after(1, m2=1)
    assert other.after(1, rate=0.5, m2=0, m5=1) == [5, 1, 1, 0, 0]


@pytest.mark.parametrize(
    ("fault", "reason"), [({"pressure": 3e5}, 1), ({"rate": -11.0}, 2), ({"temperature": 350.0}, 3), ({"lost": 1.0}, 4)]
)
def test_interlocks_keep_the_motor_off_and_switch_it_off(fault: dict[str, float], reason: int) -> None:
    mended = {"pressure": 6e5, "rate": 0.0, "temperature": 293.15, "lost": 0.0}
    console = Console()
    assert console.after(1, m2=1, **fault) == [0, 0, 0, reason, 0]
    assert console.after(1, **mended) == [2, 1, 1, 0, 0]
    assert console.after(1, **fault) == [2, 1, 0, 0, 0]  # one sample is not yet two
    assert console.after(1) == [0, 0, 0, reason, 1]
    when = console.part.get(["t_trip"])[0]
    assert when == pytest.approx((console.k - 1) * 0.01, abs=0.011)
    assert console.after(2, **mended) == [0, 0, 0, reason, 1]  # it stays off, whatever is requested
    assert console.after(1, clear=1) == [0, 0, 0, reason, 1]
    assert console.after(1, m2=0) == [0, 0, 0, 0, 0]
    assert console.after(1, m2=1, clear=0) == [2, 1, 1, 0, 0]


@pytest.mark.parametrize("mode", [2, 3, 4])
def test_no_drift_run_with_tachometer_feedback(mode: int) -> None:
    """TABLE-TACHO: it is refused, and a motor that runs is switched off, after two samples in a row."""
    console = Console()
    assert console.after(3, tacho=1.0, **{f"m{mode}": 1}) == [0, 0, 0, 7, 0]
    assert console.after(1, tacho=0.0)[:3] == [mode, 1, 1]
    assert console.after(1, tacho=1.0) == [mode, 1, 0, 0, 0]
    assert console.after(1) == [0, 0, 0, 7, 1]


def test_servo_mode_has_tachometer_feedback_while_it_captures() -> None:
    """capture_max 0.045 s: allowed for four samples; the fifth and sixth in a row end it.  Mode 5 has it always."""
    console = Console(capture_max=0.045)
    console.after(1)
    assert console.after(1, m1=1, tacho=1.0) == [1, 1, 1, 0, 0]
    assert console.after(5) == [1, 1, 0, 0, 0]
    assert console.after(1) == [0, 0, 0, 7, 1]
    captured = Console(capture_max=0.045)
    captured.after(4, m1=1, tacho=1.0)
    assert captured.after(50, tacho=0.0)[0] == 1
    assert Console().after(3000, m5=1, tacho=1.0)[0] == 5


def test_servo_and_tacho_modes_do_not_need_the_encoder() -> None:
    for mode in (1, 5):
        console = Console()
        assert console.after(5, lost=1.0, **{f"m{mode}": 1})[0] == mode
