"""Outputs that follow from inputs and discretes alone are not made again while these stay the same: no way of changing
them behind the part's back goes unnoticed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from gyrobench.packaging import load_part
from gyrobench.packaging.dependencies import followed
from gyrobench.packaging.source import PartCode

OUT = ["f[1]", "f[2]", "f[3]"]


def test_which_parts_keep_their_outputs() -> None:
    assert followed(PartCode(load_part("fixture"))) == ["mount", "omega_face", "alpha_face", "f_face"]
    assert followed(PartCode(load_part("sequencer"))) == [
        "now",
        "stage",
        "stop",
    ]  # start-only discretes stay as they are
    assert followed(PartCode(load_part("site"))) == []  # nothing changes its outputs while it runs
    for changing in ("floated_gyro", "table_servo", "rebalance_analog"):  # state, state, noise
        assert followed(PartCode(load_part(changing))) is None


@pytest.mark.parametrize("face", ["native", "native-fmi3"])
def test_inputs_set_and_set_back(instance: Callable[..., Any], face: str) -> None:
    """Set, step, set others, read (outputs made anew in between), set back, step: the outputs of the first again."""
    one = instance("fixture", face)
    one.initialize()
    first, other = {"f_face[3]": 9.8}, {"f_face[3]": -3.0, "f_face[1]": 1.0}
    one.set({"f_face[1]": 0.0, **first})
    one.step(0.0, 1e-3)
    was = one.get(OUT)
    one.set(other)
    assert one.get(OUT) != was
    one.set({"f_face[1]": 0.0, **first})
    one.step(1e-3, 1e-3)
    assert one.get(OUT) == was


@pytest.mark.parametrize("face", ["native", "native-fmi3"])
def test_outputs_that_nothing_changes_follow_the_parameters(instance: Callable[..., Any], face: str) -> None:
    one = instance("site", face)
    for gravity in (9.8, 9.81):
        one.set({"gravity": gravity})
        one.initialize()
        for k in range(3):
            one.step(k * 1e-3, 1e-3)
            assert one.get(OUT) == [0.0, 0.0, gravity]
        one.reset()


@pytest.mark.parametrize("face", ["native", "native-fmi3"])
def test_zero_has_a_sign(instance: Callable[..., Any], face: str) -> None:
    """0.0 and -0.0 are equal but give outputs of different bits."""
    one, plain = instance("fixture", face), instance("fixture", "plain")
    for part in (one, plain):
        part.initialize()
        for k, x in enumerate((0.0, -0.0)):
            part.set({"f_face[1]": x, "f_face[2]": x, "f_face[3]": x})
            part.step(k * 1e-3, 1e-3)
    assert [str(x) for x in one.get(OUT)] == [str(x) for x in plain.get(OUT)]
