"""Platforms and decouplers offer what their sockets ask for, in name, unit and shape."""

import fmpy
import pytest
from wired import BENCH

from gyrobench.packaging import build
from gyrobench.system.binding import SocketMismatchError, fit
from gyrobench.system.sockets import SOCKETS


@pytest.mark.parametrize(
    "part, socket",
    [
        ("platform_single_axis", "PlatformAxis"),
        ("platform_three_axis", "Platform"),
        ("platform_three_gimbal_2dof", "Platform"),
        ("platform_four_gimbal", "FourGimbalPlatform"),
        ("platform_four_gimbal", "Platform"),
        ("decoupler_t2", "Decoupler"),
        ("decoupler_none", "Decoupler"),
        ("gimbal_two_axis", "TwoAxisGimbal"),
        ("decoupler_los", "LosDecoupler"),
        ("base_vibration", "Vibration"),
    ],
)
def test_fits(part, socket, tmp_path):
    description = fmpy.read_model_description(str(build(part, out=tmp_path, bench=BENCH)))
    fit(SOCKETS[socket], description, slot=part)  # raises, and says what is missing


def test_another_socket_is_refused(tmp_path):
    description = fmpy.read_model_description(str(build("platform_three_axis", out=tmp_path, bench=BENCH)))
    with pytest.raises(SocketMismatchError, match="theta_4"):
        fit(SOCKETS["FourGimbalPlatform"], description, slot="platform")


@pytest.mark.parametrize(
    ("part", "socket"), [("platform_single_axis", "PlatformAxis"), ("platform_four_gimbal", "FourGimbalPlatform")]
)
def test_a_platform_without_acceleration_of_the_base_fits(part, socket, tmp_path):
    """A foreign model may make do with the rate of the base."""
    description = fmpy.read_model_description(str(build(part, out=tmp_path, bench=BENCH)))
    description.modelVariables = [v for v in description.modelVariables if not v.name.startswith("alpha_b")]
    fit(SOCKETS[socket], description, slot=part)
