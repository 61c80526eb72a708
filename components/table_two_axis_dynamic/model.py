from __future__ import annotations

from gyrobench.component import IDENTITY, Discrete, Input, Output, Parameter, sampled
from gyrobench.component.blocks.angle import IncrementalEncoder
from gyrobench.component.blocks.axis_body import AxisBody, further
from gyrobench.component.blocks.command import ARCSEC, CountCommand, SampleClock
from gyrobench.component.blocks.control import InPosition, SampledController
from gyrobench.component.blocks.drive import DcMotor, SquareLawMotor
from gyrobench.component.blocks.table import TwoAxisTable
from gyrobench.component.math import Number, cos, sin, vector
from gyrobench.component.set_up import SCALE, SCALE_PHASE, harmonic


class TableTwoAxisDynamic(TwoAxisTable):
    """Turntable with an outer axis X and an inner axis Y as it is built: counts, controllers, motors, bodies.

    Each axis is one of table_dynamic: a count command, an encoder, a sampled controller, a motor (outer DC, inner AC)
    and a body.  They act on each other: with x, y the angles, D = across[2] - across[1] the difference of the plate's
    inertias about its own axes Z and X,

        (outer_axis_J + D sin2 y) x'' = M_x - D sin(2 y) x' y' + ...
        inner_axis_J y'' = M_y + (D/2) sin(2 y) x'2 + ...

    x', x'' inertial.  outer_axis_J is that of all that turns about X at y = 0.  Attitude, rates and forces on the
    plate, squareness and wobble: block TwoAxisTable; alpha from the mean accelerations over the communication step.

    Not modelled: products of inertia of the plate, torque of the inner motor on the outer axis out of square, carrier
    and heating of the motors, sag under load, acceleration of the mounted instrument (it stands where the axes meet).
    Source: Lagrange's equations of the two bodies; Hu 1981, sections 5.4, 5.5, 6.1; each block names its equations.
    """

    version = "1.1.0"

    simulates = tuple(
        harmonic(
            [f"{axis}_{n}" for n in SCALE], [f"{axis}_{n}" for n in SCALE_PHASE],
            (f"{axis}.angle.once", f"{axis}.angle.twice"),
        )
        for axis in ("outer", "inner")
    )  # fmt: skip

    step = Parameter(1e-4, "s", "largest internal step", above=0.0)
    angle0 = Parameter([0.0, 0.0], "rad", "outer and inner angle at the start")
    period = Parameter(5e-3, "s", "sampling period of command and controller", min=1e-3, max=1e-2)
    quantum = Parameter(0.18 * ARCSEC, "rad", "angle of one count (0.18 arcsec)", above=0.0)
    index_rate = Parameter([0.1, 0.1], "rad/s", "rate of an index move", above=0.0)
    across = Parameter([0.6, 0.6], "kg.m2", "inertia of the plate about its own axes X and Z", above=0.0)

    clock = SampleClock(period="period")
    outer = CountCommand(period="period", quantum="quantum")
    inner = CountCommand(period="period", quantum="quantum")
    outer_law = SampledController(
        period="period", quantum="quantum", M_max=Parameter(14.9, "N.m", "largest torque demanded", above=0.0)
    )
    inner_law = SampledController(period="period", quantum="quantum")
    outer_near = InPosition()
    inner_near = InPosition()
    outer_motor = DcMotor()
    inner_motor = SquareLawMotor()
    outer_axis = AxisBody()
    inner_axis = AxisBody()
    outer_scale = IncrementalEncoder(quantum="quantum")
    inner_scale = IncrementalEncoder(quantum="quantum")

    mode_x = Input(0.0, "1", "outer axis: 0 hold, 1 index, 2 rate")
    target_x = Input(0.0, "1", "outer axis: angle in rad (index) or rate in rad/s (rate)")
    mode_y = Input(0.0, "1", "inner axis: 0 hold, 1 index, 2 rate")
    target_y = Input(0.0, "1", "inner axis: angle in rad (index) or rate in rad/s (rate)")
    face = Input(IDENTITY, "1", "mount: rows are the gyro axes in plate axes")

    in_position = Output("1", "1 when both targets are reached")
    torque_x = Output("N.m", "torque of the outer motor")
    torque_y = Output("N.m", "torque of the inner motor")
    saturated = Output("1", "1 while a demanded torque is limited")

    load_x = Discrete(0.0, "N.m", "torque of plate and unbalance on the outer axis")
    load_y = Discrete(0.0, "N.m", "torque of plate and unbalance on the inner axis")

    def start(self) -> None:
        difference = self.across[1] - self.across[0]
        self.refuse(
            self.outer_axis_J + difference <= 0.0 or self.outer_axis_J <= self.across[0],
            "outer_axis_J = {outer_axis_J} kg.m2 holds the inertia of the plate about X, across[1]: it must be larger, "
            "and stay positive with the plate upright, outer_axis_J + across[2] - across[1]",
        )
        self.outer.rest(self.angle0[0])
        self.inner.rest(self.angle0[1])
        self.outer_axis.rest(self.angle0[0], 0.0, self.earth_x())
        c_x = cos(self.angle0[0])
        s_x = sin(self.angle0[0])
        self.inner_axis.rest(self.angle0[1], 0.0, self.earth_y(c_x, s_x))
        self.outer_scale.latch(self.angle0[0])
        self.inner_scale.latch(self.angle0[1])
        self.weigh(c_x, s_x, cos(self.angle0[1]), sin(self.angle0[1]), 0.0, 0.0)

    def earth_x(self) -> Number:
        return self.base[0] @ self.omega_local

    def earth_y(self, c: Number, s: Number) -> Number:
        """Return the rate of the site along the inner axis; c, s of the outer angle."""
        return c * (self.base[1] @ self.omega_local) + s * (self.base[2] @ self.omega_local)

    def weigh(self, c_x: Number, s_x: Number, c: Number, s: Number, w_x: Number, v_y: Number) -> None:
        """Set inertia and loads at these rates; c_x, s_x of the outer angle, c, s of the inner one."""
        difference = self.across[1] - self.across[0]
        self.outer_axis.weigh(self.outer_axis_J + difference * s * s)
        self.load_x = -2.0 * difference * s * c * w_x * v_y
        self.load_y = difference * s * c * w_x * w_x
        g = self.base @ self.f_local
        if self.outer_axis_unbalance[0] != 0.0 or self.outer_axis_unbalance[1] != 0.0:
            self.load_x = self.load_x + self.outer_axis.unbalanced(c_x, s_x, vector([g[1], g[2], g[0]]))
        if self.inner_axis_unbalance[0] != 0.0 or self.inner_axis_unbalance[1] != 0.0:
            up = c_x * g[2] - s_x * g[1]
            self.load_y = self.load_y + self.inner_axis.unbalanced(c, s, vector([up, g[0], 0.0]))

    def flow(self) -> None:
        self.outer_axis.turn(self.outer_motor_M_mean, self.load_x, self.earth_x())
        e_y = self.earth_y(cos(self.outer_axis_x), sin(self.outer_axis_x))
        self.inner_axis.turn(self.inner_motor_M_mean, self.load_y, e_y)

    @sampled(every=1)
    def tick(self) -> None:
        e_x = self.earth_x()
        c_x = cos(self.outer_axis_x)
        s_x = sin(self.outer_axis_x)
        c_y = cos(self.inner_axis_x)
        s_y = sin(self.inner_axis_x)
        e_y = self.earth_y(c_x, s_x)
        self.weigh(c_x, s_x, c_y, s_y, self.outer_axis_w, self.inner_axis_w - e_y)
        self.outer_axis.settle(self.outer_motor_M, self.load_x, e_x)
        self.inner_axis.settle(self.inner_motor_M, self.load_y, e_y)
        half = 0.5 * self.h  # the loads of the next step at its middle
        x = further(c_x, s_x, half * self.outer_axis_v)
        y = further(c_y, s_y, half * self.inner_axis_v)
        w_x = self.outer_axis_w + half * self.outer_axis_acc
        self.weigh(x[0], x[1], y[0], y[1], w_x, self.inner_axis_v + half * self.inner_axis_acc)
        self.clock.tick()
        if self.clock_due == 1.0 or self.t > self.step_end - 0.5 * self.h:  # nobody sees the counts in between
            self.outer_scale.latch(self.outer_axis_x)
            self.inner_scale.latch(self.inner_axis_x)
        self.outer_law.wait()
        self.inner_law.wait()
        if self.clock_due == 1.0:
            self.outer.advance(self.mode_x, self.target_x, self.outer_way, self.index_rate[0])
            self.inner.advance(self.mode_y, self.target_y, self.inner_way, self.index_rate[1])
            self.outer_law.sample(self.outer_count - self.outer_scale_count, self.outer.acc())
            self.inner_law.sample(self.inner_count - self.inner_scale_count, self.inner.acc())
            self.outer_near.judge(self.outer_law_e, self.period)
            self.inner_near.judge(self.inner_law_e, self.period)
        self.outer_motor.advance(self.outer_law_demand, self.outer_axis_v, self.outer_axis_x)
        self.inner_motor.advance(self.inner_law_demand, self.inner_axis_v)

    def outputs(self) -> None:
        e_y = self.earth_y(cos(self.outer_axis_x), sin(self.outer_axis_x))
        self.place(
            vector([self.outer_axis_x, self.inner_axis_x]),
            vector([self.outer_axis_w - self.earth_x(), self.inner_axis_w - e_y]),
            vector([self.outer_axis_acc_mean, self.inner_axis_acc_mean]),
        )
        self.angle_x_read = self.outer_scale_count * self.quantum
        self.angle_y_read = self.inner_scale_count * self.quantum
        self.in_position = self.outer_arrived * self.inner_arrived * self.outer_near_inside * self.inner_near_inside
        self.torque_x = self.outer_motor_M
        self.torque_y = self.inner_motor_M
        self.saturated = 1.0 if self.outer_law_saturated + self.inner_law_saturated > 0.0 else 0.0
