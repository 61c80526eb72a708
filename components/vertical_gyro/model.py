from __future__ import annotations

from gyrobench.component import Component, Input, Noise, Output, Parameter, State, sampled
from gyrobench.component.math import Vector, asin, atan2, clip, cos, cross, fabs, maximum, sign, sin, sqrt, vector


class VerticalGyro(Component):
    """Gyro whose rotor axis keeps the vertical; gimbals for roll and pitch, and a follow-up ring.  [VERTICAL-GYRO]

    n is the rotor axis, a unit vector; x right, y forward, z up.  The rotor precesses towards the torque:

        n' = (T / H + drift) - ((T / H + drift) n) n - omega x n              in vehicle axes, omega inertial

    Axes of the inner element: z_i = n.  Without the ring (ring = 0) gimbals from outside: roll about y, pitch about x:

        roll = atan2(-n_x, n_z),  pitch = asin(n_y);     near |pitch| = 90 deg they lock, and the run ends

    With the ring (ring = 1) from outside: ring g4 (roll), g3 (pitch), g2 (roll); a servo turns the ring so that g2
    stays 0 and rotor, inner and outer axis stay at right angles; roll = -g4 and pitch = -g3 go through 360 deg:

        g4' = k_ring G g2, |g4'| <= ring_rate;    dg2/dg4 = -cos g3, hence G = sign(cos g3) (reversal = 0: G = 1)

    Torques T_x, T_y and drift act along x_i, y_i.  e_x, e_y are the rotations about x_i, y_i that carry the apparent
    vertical (the direction of f) into n, as level switches on the inner element measure them:

        e_x = atan2(f_yi, f_zi),  e_y = -atan2(f_xi, f_zi)                    turn = omega along n

    At the start n is the apparent vertical, turned by tilt about x and y.

    Not modelled: nutation, inertia and friction of gimbals and ring, the tilt of the roll axis' torquer when pitched
    (torques act along the inner element's axes), pendulosity, rotor speed, stops.
    Source: GSP ch. 5, section 5.3.1 (text; no equations); VERTICAL-GYRO, PLATFORM-4GIMBAL.
    """

    version = "1.1.0"
    integrator = "rk4"
    rk4_substeps = 1

    H = Parameter(0.5, "N.m.s", "spin angular momentum", above=0.0)
    tilt = Parameter([0.0, 0.0], "rad", "tilt of the rotor axis at the start, about x and y", min=-3.0, max=3.0)
    drift = Parameter([0.0, 0.0], "rad/s", "drift towards x and y of the inner element")
    white = Noise(0.0, "rad/s/sqrt(Hz)", "white drift density, towards x")
    white_y = Noise(0.0, "rad/s/sqrt(Hz)", "white drift density, towards y")
    ring = Parameter(True, bool, "1: with follow-up ring")
    k_ring = Parameter(30.0, "1/s", "gain of the ring's servo", above=0.0)
    ring_rate = Parameter(5.0, "rad/s", "largest rate of the ring", above=0.0)
    reversal = Parameter(True, bool, "1: the ring's servo turns its sign beyond 90 deg of pitch")

    omega = Input([0.0, 0.0, 0.0], "rad/s", "inertial rate of the vehicle, vehicle axes")
    f = Input([0.0, 0.0, 9.80665], "m/s2", "specific force of the vehicle, vehicle axes")
    alpha = Input([0.0, 0.0, 0.0], "rad/s2", "derivative of omega, vehicle axes")
    T_x = Input(0.0, "N.m", "erection torque about x of the inner element")
    T_y = Input(0.0, "N.m", "erection torque about y of the inner element")

    pitch = Output("rad", "pitch of the vehicle as measured")
    roll = Output("rad", "roll of the vehicle as measured")
    e_x = Output("rad", "lean against the apparent vertical about x of the inner element")
    e_y = Output("rad", "lean against the apparent vertical about y of the inner element")
    f_inner = Output("m/s2", "specific force in axes of the inner element", shape=(3,))
    turn = Output("rad/s", "inertial rate of the vehicle along the rotor axis")
    inner = Output("rad", "angle g2 that the ring's servo keeps at 0")
    ring_angle = Output("rad", "angle g4 of the ring")

    n = State([0.0, 0.0, 1.0], "1", "rotor axis, vehicle axes")
    g4 = State(0.0, "rad", "angle of the ring")

    def start(self) -> None:
        size = sqrt(self.f @ self.f)
        self.refuse(size < 1e-6, "no specific force at the start: the rotor axis is set from the apparent vertical")
        # u turned about the vector t = (tilt_x, tilt_y, 0): u cos|t| + t x u sin|t|/|t| + t (t u)(1 - cos|t|)/|t|2
        v = self.f / size
        a = self.tilt[0]
        b = self.tilt[1]
        angle = sqrt(a * a + b * b)
        s = sin(angle) / angle if angle > 0.0 else 1.0
        along = (a * v[0] + b * v[1]) * (1.0 - cos(angle)) / (angle * angle) if angle > 0.0 else 0.0
        self.n[0] = v[0] * cos(angle) + s * b * v[2] + along * a
        self.n[1] = v[1] * cos(angle) - s * a * v[2] + along * b
        self.n[2] = v[2] * cos(angle) + s * (a * v[1] - b * v[0])
        self.g4 = atan2(self.n[0], self.n[2]) if self.ring else 0.0

    def in_ring(self) -> Vector:
        """Return (sin g2, cos g3 cos g2), from the rotor axis in axes of the ring; n_y is -sin g3 cos g2."""
        c = cos(self.g4)
        s = sin(self.g4)
        return vector([clip(c * self.n[0] - s * self.n[2], -1.0, 1.0), s * self.n[0] + c * self.n[2]])

    def inner_x(self) -> Vector:
        """Return x_i in vehicle axes: of the gimbal beside the rotor, R2(g4)' R1(g3)' (cos g2, 0, -sin g2)."""
        if self.ring:
            c = cos(self.g4)
            s = sin(self.g4)
            r = self.in_ring()
            c2 = sqrt(1.0 - r[0] * r[0])
            level = maximum(c2, 1e-9)
            out = -r[0] * r[1] / level
            return vector([c * c2 + s * out, -r[0] * self.n[1] / level, -s * c2 + c * out])
        level = sqrt(self.n[0] * self.n[0] + self.n[2] * self.n[2])
        return vector([self.n[2] / level, 0.0, -self.n[0] / level])

    def flow(self) -> None:
        self.der.g4 = 0.0
        if self.ring:
            r = self.in_ring()
            sense = sign(r[1]) if self.reversal else 1.0
            self.der.g4 = clip(self.k_ring * sense * asin(r[0]), -self.ring_rate, self.ring_rate)
        w = self.omega + (self.t - self.step_end) * self.alpha  # omega is that of the end of the communication step
        x = self.inner_x()
        y = cross(self.n, x)
        to_x = self.T_x / self.H + self.drift[0] + self.noise.white
        to_y = self.T_y / self.H + self.drift[1] + self.noise.white_y
        self.der.n[0] = to_x * x[0] + to_y * y[0] - w[1] * self.n[2] + w[2] * self.n[1]
        self.der.n[1] = to_x * x[1] + to_y * y[1] - w[2] * self.n[0] + w[0] * self.n[2]
        self.der.n[2] = to_x * x[2] + to_y * y[2] - w[0] * self.n[1] + w[1] * self.n[0]

    @sampled(every=1)
    def tick(self) -> None:
        self.n = self.n / sqrt(self.n @ self.n)
        self.refuse(
            self.ring == 0.0 and fabs(self.n[1]) > 0.9998,
            "the gimbals have locked: pitch within 1.15 deg of 90 deg, and ring = 0: take the follow-up ring",
        )

    def outputs(self) -> None:
        if self.ring:
            r = self.in_ring()
            self.pitch = atan2(self.n[1], r[1])
            self.roll = -self.g4
            self.inner = asin(r[0])
        else:
            self.pitch = atan2(self.n[1], sqrt(self.n[0] * self.n[0] + self.n[2] * self.n[2]))
            self.roll = atan2(-self.n[0], self.n[2])
            self.inner = 0.0
        self.ring_angle = self.g4
        x = self.inner_x()
        self.f_inner = vector([x, cross(self.n, x), self.n]) @ self.f
        self.e_x = atan2(self.f_inner[1], self.f_inner[2])
        self.e_y = -atan2(self.f_inner[0], self.f_inner[2])
        self.turn = self.n @ self.omega
