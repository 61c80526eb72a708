from __future__ import annotations

from gyrobench.component import Component, Input, Noise, Output, Parameter, State, sampled
from gyrobench.component.math import Number, Vector, asin, atan2, clip, cos, fabs, floor, pi, sin, sqrt, tan, vector

G0 = 9.80665
MOST = 85.0 * pi / 180.0  # latitude


class Gyrocompass(Component):
    """Pendulous gyrocompass: rotor axis h, bottom-heavy, damped by a vertical or by a horizontal torque.  [GYROCOMPASS]

    Level axes E, N, U; e = h x U / |h x U| to the right of h, level; v = e x h up.  The sensitive element has turned
    by s about h: e' = e cos s - v sin s, u = v cos s + e sin s.  With the specific force f, f_h = h . f, g0 = 9.80665:

        h' = (-mgl (f_h/g0) e' + C x e' - D (f_h/g0) u)/H + (drift_az + slew) e + drift_el v - rate x h
        T x' = f_h/g0 - x                                            liquid: damping by a horizontal torque, C < mgl
        s'' = (2 pi/swing_period)^2 (f_e cos s - f_v sin s)/g0 - 2 zeta (2 pi/swing_period) s'

    Small angles (az east, el up): az' = rate_U - (mgl/H + rate_N) el + C x/H, el' = rate_N az + rate_E' - D el/H.  The
    pendulum feels acceleration to the north (ballistic deflection); that across h swings the element, so that the
    pendulum's torque gets a part about the vertical (rolling error between the quarters).  `cut` takes the damping
    away: D acts no more, the valve of the liquid is shut.

    Reading: psi_c = heading - az, and with the corrections (latitude and speed as set and as by the log)

        psi_1 = psi_c + D tan L/(mgl + H w cos L),    psi = psi_1 - asin(V cos psi_1/(R w cos L))

    Not modelled: nutation, inertia about e and v, follow-up and its dead zone, friction (put its torque into the
    drift), gimballing errors of the suspension, temperature, run-up of the rotor, flow of the liquid beside its level.
    Source: GSP ch. 5, section 5.3.2, fig. 5-20 (text only); own derivation.
    """

    version = "1.0.0"
    integrator = "rk4"
    rk4_substeps = 1

    step = Parameter(0.1, "s", "largest internal step", above=0.0)
    H = Parameter(12.0, "N.m.s", "spin angular momentum", above=0.0)
    mgl = Parameter(0.33, "N.m", "pendulous moment: torque for a tilt of 1 rad at 9.80665 m/s2", above=0.0)
    D = Parameter(0.0, "N.m/rad", "vertical damping torque for a tilt", min=0.0)
    C = Parameter(0.0, "N.m/rad", "torque of the damping liquid for its level", min=0.0)
    T = Parameter(800.0, "s", "time constant of the liquid", above=0.0)
    swing_period = Parameter(60.0, "s", "period of the swing of the element about the rotor axis", above=0.0)
    swing_damping = Parameter(0.2, "1", "its damping ratio", min=0.0)
    azimuth_start = Parameter(0.0, "rad", "azimuth of the rotor axis at the start, east", min=-3.1416, max=3.1416)
    tilt_start = Parameter(0.0, "rad", "its tilt at the start, up", min=-1.0, max=1.0)
    drift_az = Parameter(0.0, "rad/s", "drift in azimuth, east")
    drift_el = Parameter(0.0, "rad/s", "drift in tilt, up")
    white_az = Noise(0.0, "rad/s/sqrt(Hz)", "density of the random drift in azimuth")
    white_el = Noise(0.0, "rad/s/sqrt(Hz)", "density of the random drift in tilt")
    white = Noise(0.0, "rad/sqrt(Hz)", "density of the noise of the reading")
    latitude_correction = Parameter(False, bool, "1: the reading is corrected for the latitude error")
    speed_correction = Parameter(False, bool, "1: the reading is corrected for the speed error")
    latitude = Parameter(0.6981317007977318, "rad", "latitude set for the corrections (40 deg)", min=-MOST, max=MOST)
    earth_rate = Parameter(7.2921159e-5, "rad/s", "Earth rate of the corrections", above=0.0)
    radius = Parameter(6.371e6, "m", "radius of the Earth of the corrections", above=1e6)

    rate = Input([0.0, 5.586e-5, 4.687e-5], "rad/s", "inertial rate of the level axes E, N, U")
    f = Input([0.0, 0.0, 9.80665], "m/s2", "specific force at the compass, E, N, U")
    heading = Input(0.0, "rad", "heading of the ship, clockwise")
    speed = Input(0.0, "m/s", "speed by the log")
    cut = Input(0.0, "1", "1: the damping is cut off")
    slew = Input(0.0, "rad/s", "precession in azimuth asked for, east")

    psi = Output("rad", "heading shown, clockwise, -pi to pi")
    azimuth = Output("rad", "azimuth of the rotor axis, east")
    tilt = Output("rad", "tilt of the rotor axis, up")
    swing = Output("rad", "swing of the element about the rotor axis, top towards e")

    axis = State([0.0, 1.0, 0.0], "1", "rotor axis, E, N, U")
    x = State(0.0, "rad", "level of the liquid")
    s = State(0.0, "rad", "swing")
    sd = State(0.0, "rad/s", "rate of the swing")

    def start(self) -> None:
        self.refuse(
            self.mgl <= self.C,
            "C = {C} N.m/rad: the liquid's torque must be below the pendulum's, mgl = {mgl}, else it lies upside down",
        )
        self.axis[0] = sin(self.azimuth_start) * cos(self.tilt_start)
        self.axis[1] = cos(self.azimuth_start) * cos(self.tilt_start)
        self.axis[2] = sin(self.tilt_start)
        self.x = sin(self.tilt_start)

    def level(self) -> Vector:
        """Return e, to the right of h and level."""
        size = sqrt(self.axis[0] * self.axis[0] + self.axis[1] * self.axis[1])
        return vector([self.axis[1] / size, -self.axis[0] / size, 0.0])

    def flow(self) -> None:
        h = vector([self.axis[0], self.axis[1], self.axis[2]])
        e = self.level()
        v = vector([e[1] * h[2], -e[0] * h[2], e[0] * h[1] - e[1] * h[0]])
        along = (h @ self.f) / G0
        cs = cos(self.s)
        ss = sin(self.s)
        damped = 1.0 if self.cut < 0.5 else 0.0
        level = (-self.mgl * along + self.C * self.x) / self.H
        upright = -damped * self.D * along / self.H
        to_e = level * cs + upright * ss + self.drift_az + self.slew + self.noise.white_az
        to_v = -level * ss + upright * cs + self.drift_el + self.noise.white_el
        w = self.rate
        self.der.axis[0] = to_e * e[0] + to_v * v[0] - (w[1] * h[2] - w[2] * h[1])
        self.der.axis[1] = to_e * e[1] + to_v * v[1] - (w[2] * h[0] - w[0] * h[2])
        self.der.axis[2] = to_e * e[2] + to_v * v[2] - (w[0] * h[1] - w[1] * h[0])
        self.der.x = damped * (along - self.x) / self.T
        turn = 2.0 * pi / self.swing_period
        self.der.s = self.sd
        sideways = ((e @ self.f) * cs - (v @ self.f) * ss) / G0
        self.der.sd = turn * turn * sideways - 2.0 * self.swing_damping * turn * self.sd

    @sampled(every=1)
    def tick(self) -> None:
        self.axis = self.axis / sqrt(self.axis @ self.axis)
        self.refuse(
            fabs(self.axis[2]) > 0.9998, "the rotor axis stands upright: from there a gyrocompass does not find north"
        )

    def wrapped(self, angle: Number) -> Number:
        return angle - 2.0 * pi * floor(angle / (2.0 * pi) + 0.5)

    def outputs(self) -> None:
        self.azimuth = atan2(self.axis[0], self.axis[1])
        self.tilt = asin(clip(self.axis[2], -1.0, 1.0))
        self.swing = self.s
        shown = self.heading - self.azimuth
        north = self.earth_rate * cos(self.latitude)
        if self.latitude_correction:
            shown = shown + self.D * tan(self.latitude) / (self.mgl + self.H * north)
        if self.speed_correction:
            shown = shown - asin(clip(self.speed * cos(shown) / (self.radius * north), -1.0, 1.0))
        self.psi = self.wrapped(shown + self.noise.white)
