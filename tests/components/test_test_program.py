"""Program of a test and the stand that it switches: wheel by its closed forms, steps of the program one by one."""

from __future__ import annotations

import math
from typing import Any

import pytest
from native_parts import make
from wired import BENCH

from gyrobench.packaging.instance import InstanceError, Plain
from gyrobench.packaging.loading import load_part

QUIET = {"pickoff": 0.0, "reading": 0.0, "ammeter": 0.0}
H = 1e-2


def stand(**values: Any) -> Any:
    made = make("gyro_stand", "native")
    made.set({**QUIET, **values})
    made.initialize(0.0)
    return made


def time_until(made: Any, begin: float, longest: float, reached: Any, h: float = H) -> float:
    """Step until the outputs (speed, current) satisfy ``reached``; return the time, inf: never."""
    for k in range(round(longest / h)):
        made.step(begin + k * h, h)
        if reached(*made.get(["wheel_speed", "wheel_current"])):
            return (k + 1) * h
    return math.inf


@pytest.mark.parametrize(("supply", "drag"), [(1.0, 1e-6), (0.8, 1e-6), (1.0, 2.5e-6)])
def test_wheel_runs_up_and_down_by_its_closed_forms(supply: float, drag: float) -> None:
    """Torque 8e-3 supply2, drag 2500 D: synchronous after -(J/D) ln(1 - 2500 D/torque), then the share of the torque
    in the current; braked by 4e-3 to 100 rad/s after (J/D) ln((2500 D + M_b)/(100 D + M_b)).
    """
    made = stand(supply=supply, D=drag)
    try:
        made.set({"wheel": 1.0})
        share = 2500.0 * drag / (8e-3 * supply**2)
        run = supply * (0.05 + 0.25 * share)
        wanted = -8e-5 / drag * math.log(1.0 - share)
        t = time_until(made, 0.0, 200.0, lambda n, i: abs(i - run) < 1e-9)
        assert t == pytest.approx(wanted, abs=2.0 * H + 1e-4 * wanted)
        assert made.get(["wheel_speed"])[0] == 2500.0
        made.set({"wheel": 0.0, "brake": 1.0})
        t = time_until(made, t, 200.0, lambda n, i: n < 100.0)
        rest = 8e-5 / drag * math.log((2500.0 * drag + 4e-3) / (100.0 * drag + 4e-3))
        assert t == pytest.approx(rest, abs=2.0 * H + 1e-4 * rest)
    finally:
        made.free()


def test_wheel_without_torque_never_locks_and_one_that_loses_it_falls_out() -> None:
    """Half the voltage has a quarter of the torque, 2e-3 below the drag of 2.5e-3 at n_s: it stays at 2000 rad/s and
    takes 0.5 (0.05 + 0.25) A; one that falls out comes down to it with 8 s.
    """
    made = stand(supply=0.5, D=1e-6, J_w=8e-6)  # ten times as quick
    made.set({"wheel": 1.0})
    time_until(made, 0.0, 120.0, lambda n, i: False)
    assert made.get(["wheel_speed", "wheel_current", "synchronous"]) == pytest.approx([2000.0, 0.15, 0.0], abs=1e-2)
    made.free()
    made = stand(J_w=8e-6, dropped=0.5, drop=10.0)
    made.set({"wheel": 1.0})
    time_until(made, 0.0, 9.0, lambda n, i: False)
    assert made.get(["synchronous"])[0] == 1.0
    time_until(made, 9.0, 60.0, lambda n, i: False)
    assert made.get(["wheel_speed", "synchronous"]) == pytest.approx(
        [2000.0 + 500.0 * math.exp(-(69.0 - 10.0) / 8.0), 0.0], abs=2e-3
    )
    made.free()


def test_pickoff_and_torquer_pass_the_stand() -> None:
    made = stand(offset=1e-3, polarity=-1)
    made.set({"u": 0.02, "i": 0.3})
    made.step(0.0, H)
    assert made.get(["u_out", "i_out"]) == pytest.approx([1e-3, -0.3], abs=1e-15)
    made.set({"excitation": 1.0})
    made.step(H, H)
    assert made.get(["u_out"]) == pytest.approx([0.021], abs=1e-15)
    made.free()


def test_program_does_not_take_a_wheel_that_never_ran_up_for_a_synchronous_one() -> None:
    """Its current is in the range of a synchronous wheel from the start: after t_wheel it is called not synchronous."""
    made = Plain(load_part("test_program", BENCH))
    made.set({"hold": 0.1, "t_wheel": 1.0, "t_open": 0.1, "temperature": 0.0, "wheel_current": 0.128})
    made.initialize(0.0)
    seen = []
    for k in range(400):
        made.step(k * H, H)
        seen.append(made.get(["state", "reason"]))
    states = [round(s) for s, _ in seen]
    assert sorted(set(states)) == [1, 2, 11, 12, 13, 14] and states == sorted(states)
    assert seen[-1][1] == 2.0 and states.index(11) - states.index(2) == pytest.approx(100, abs=2)


def test_program_refuses_empty_ranges() -> None:
    made = Plain(load_part("test_program", BENCH))
    made.set({"current_low": 0.2})
    with pytest.raises(InstanceError, match="current_low must be below current_high"):
        made.initialize(0.0)


def test_a_thermostat_that_is_off_cools_to_its_room() -> None:
    """One shell, 500 J/K and 1 W/K: off, it falls towards -45 K with 500 s, and its integral stands still."""
    made = make("thermostat", "native")
    made.set({"stages": 1})
    made.initialize(0.0)
    made.set({"on": 0.0})
    for k in range(100):
        made.step(5.0 * k, 5.0)
    assert made.get(["shell[3]"])[0] == pytest.approx(-45.0 * (1.0 - math.exp(-1.0)), abs=1e-6)
    assert made.get(["heat[3]"])[0] == 0.0
    made.free()
