from __future__ import annotations

from gyrobench.component import Component, Input, Output, Parameter
from gyrobench.component.math import cos, fabs


class AxisCoupling(Component):
    """Coupling of the two axes of a servo table: secant gain, common readiness, stop before gimbal lock.

        u_outer = u / cos(angle)                    pickoff about gyro x, for the servo of the outer axis
        in_position = 1 while both axes are ready

    The gyro's x axis lies in the plane of the outer axis X and the gyro's z axis, at the inner angle from X: the outer
    axis moves it by cos(angle) only, and the gain of its loop would fall by as much.  Near 90 degrees no gain helps: z
    and the outer axis run together (gimbal lock), so a run ends where |cos(angle)| falls below `least`.

    Not modelled: errors of the resolver that gives cos(angle), its bandwidth.
    Source: TEST-SERVO2-2DOF, SERVO2-KIN; Hu 1981, eq. 3-94..3-99.
    """

    version = "1.0.0"

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    least = Parameter(0.2, "1", "smallest cosine of the inner angle that is allowed", above=0.0, max=1.0)

    u = Input(0.0, "V", "pickoff voltage about gyro x")
    angle = Input(0.0, "rad", "inner angle")
    ready_x = Input(0.0, "1", "1 when the outer axis is in position")
    ready_y = Input(0.0, "1", "1 when the inner axis is in position")

    u_outer = Output("V", "voltage for the servo of the outer axis")
    in_position = Output("1", "1 when both axes are in position")

    def outputs(self) -> None:
        c = cos(self.angle)
        self.refuse(
            not (fabs(c) >= self.least),
            "gimbal lock: inner angle {angle} rad, its cosine is below least = {least}; the outer axis cannot turn the "
            "gyro about its x axis there",
        )
        self.u_outer = self.u / c
        self.in_position = self.ready_x * self.ready_y
