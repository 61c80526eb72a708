from __future__ import annotations

from gyrobench.component import IDENTITY, Discrete, Input, Noise, Output, Parameter, State, sampled
from gyrobench.component.blocks.table import AxisTable, SegmentMotion
from gyrobench.component.math import Number, clip, cos, fabs, floor, maximum, pi, sin, sqrt, tanh
from gyrobench.component.set_up import harmonic, unbalanced

DRIVEN, CAPTURE, FINE = 0.0, 1.0, 2.0  # stages: kinematic modes; servo, far from null; servo, loop closed
SIXTH = 1.0 / 6.0


class TableServo(AxisTable):
    """Turntable with one axis that a gyro holds still in inertial space.  [TABLE-SERVO, LOOP-TABLE-SERVO, CTRL-CAPTURE]

    Modes 0 hold, 1 index, 2 rate are kinematic, those of table_rate.  Mode 3 (w inertial rate about the axis, e that of
    the base, x angle against the base, M motor torque with three networks C(s) = prod (1 + s / zero) / (1 + s / pole))

        J w' = M + M_load + torque - D (w - e) - (H_g / K_g) u'        x' = w - e        M = -G C(s) u / (1 + lag s)

    nulls the pickoff voltage u of a gyro with its input axis along the table axis: w = omega_d, x' = -omega_E - omega_M
    (MEAS-SERVO).  H_g, J_g, C_g, K_g are the gyro; G follows from the crossover or from K_T = G K_g H_g / C_g:

        L(s) = G K_g H_g C(s) / ( s [ (J s + D) (J_g s + C_g) + H_g2 ] (1 + lag s) ),   |L(j crossover)| = 1

    Servo mode begins with capture, M = -clip(k_p u) - k_d w, until u and w stay near zero, or u alone for so long that
    w - omega_d must have been slow; then the networks are preset and the fine loop closes.  With capture_law 1 the rate
    wanted is that from which the motor can just brake, proximate time-optimal [Workman 1987]:

        M = -k_d (f(e) + w)    f = k e up to e_l, sign(e) (sqrt(2 a |e|) - k e_l) beyond    e = u / sensitivity
        k = k_p/k_d,  a = capture_share torque_max / J,  e_l = a / (2 k2), at which both have the slope k

    All linear terms
    are integrated exactly; load, limit and square law of the motor are taken once in each internal step and stay out of
    the linearization.

    Not modelled: stiction before breakaway, wobble, torsion between motor and plate, air bearing and slip-ring
    follower (their torque comes in by `torque`), carrier ripple, stops, drop-out from the fine loop.
    Source: Hu 1981, eq. 3-54, 3-55, 5-1..5-21, sections 5.5 (one-1), 6.1 (item 6).
    """

    version = "1.1.0"

    angle0 = Parameter(0.0, "rad", "angle at the start")
    acceleration = Parameter(0.1, "rad/s2", "acceleration of every kinematic move", above=0.0)
    index_rate = Parameter(0.1, "rad/s", "rate of an index move", above=0.0)
    rate_max = Parameter(10.0, "rad/s", "largest rate that may be commanded", above=0.0)

    J = Parameter(2.56, "kg.m2", "inertia of table and load about the axis", above=0.0)
    viscous = Parameter(0.0, "N.m.s/rad", "viscous friction and back EMF, of the rate against the base", min=0.0)
    friction = Parameter(0.0, "N.m", "Coulomb friction", min=0.0)
    friction_rate = Parameter(2e-6, "rad/s", "rate at which it is 76 % there", above=0.0)
    ripple = Parameter(0.0, "N.m", "torque ripple, amplitude", min=0.0)
    ripple_cycles = Parameter(36, int, "its cycles per turn", min=1, max=100000)
    ripple_phase = Parameter(0.0, "rad", "its phase at angle 0")
    unbalance = Parameter([0.0, 0.0], "kg.m", "mass times offset along the first and second table axis")
    rumble = Noise(0.0, "N.m/sqrt(Hz)", "random torque density (brushes, air)")

    torque_max = Parameter(9.80665, "N.m", "largest motor torque (1 kg.m)", above=0.0)
    shaper = Parameter(1, int, "root shaper before the square-law motor: 1 torque = demand, 0 square law", min=0, max=1)
    lag = Parameter(5e-4, "s", "lag of demodulator and drive", above=0.0)
    polarity = Parameter(1, int, "1: input axis along the table axis; -1: against it", min=-1, max=1)
    network = Parameter(2, int, "1: 0.4 ms, 2: 1 ms, 3 and 4: undamped gyro, 0: own zeros and poles", min=0, max=4)
    zeros = Parameter([100.0, 100.0, 100.0], "rad/s", "zeros of the three networks (network 0)", above=0.0)
    poles = Parameter([100.0, 100.0, 100.0], "rad/s", "poles of the three networks (network 0)", above=0.0)
    crossover = Parameter(0.0, "rad/s", "crossover of the loop; 0: 50 Hz (networks 1, 2) or 10 Hz (3, 4)", min=0.0)
    stiffness = Parameter(0.0, "N.m/rad", "static stiffness K_T; 0: that which makes the crossover", min=0.0)
    H_g = Parameter(0.2, "N.m.s", "gyro: spin angular momentum", above=0.0)
    J_g = Parameter(2e-4, "kg.m2", "gyro: float inertia", above=0.0)
    C_g = Parameter(0.2, "N.m.s/rad", "gyro: float damping; 0: undamped", min=0.0)
    K_g = Parameter(10.0, "V/rad", "gyro: pickoff gain", above=0.0)

    capture = Parameter(1, int, "1: capture first, 0: close the fine loop immediately", min=0, max=1)
    capture_rate = Parameter(8.0 * pi, "rad/s", "natural frequency while capturing (4 Hz)", above=0.0)
    capture_damping = Parameter(1.2, "1", "damping ratio while capturing, by the tachometer", above=0.0)
    capture_speed = Parameter(pi / 90.0, "rad/s", "speed limit while capturing (2 deg/s)", above=0.0)
    capture_angle = Parameter(8.0 * pi / 648000.0, "rad", "fine below this table angle from null (8 arcsec)", above=0.0)
    capture_slow = Parameter(3e-5, "rad/s", "fine below this rate, or this one against the drift", above=0.0)
    capture_law = Parameter(0, int, "0: speed limit, 1: proximate time-optimal", min=0, max=1)
    capture_share = Parameter(
        0.8, "1", "share of the largest torque that braking counts on (law 1)", above=0.0, max=1.0
    )
    capture_hold = Parameter(0.05, "s", "when both held for this long", min=0.0)

    simulates = (
        harmonic(("encoder_amplitude",), ("encoder_phase",), ("angle.once", "angle.twice")),
        unbalanced("unbalance"),
    )
    encoder_amplitude = Parameter([0.0, 0.0, 0.0], "rad", "encoder error of orders 1, 2 and encoder_fine")
    encoder_phase = Parameter([0.0, 0.0, 0.0], "rad", "their phases at angle 0")
    encoder_fine = Parameter(360, int, "order of the fine encoder error, cycles per turn", min=1, max=100000)
    quantum = Parameter(0.0, "rad", "quantum of angle_read; 0: none", min=0.0)

    mode = Input(0.0, "1", "0 hold, 1 index, 2 rate, 3 servo")
    target = Input(0.0, "1", "angle in rad (index) or rate in rad/s (rate)")
    face = Input(IDENTITY, "1", "mount: rows are the gyro axes in table axes")
    u = Input(0.0, "V", "pickoff voltage of the gyro")
    torque = Input(0.0, "N.m", "disturbance torque on the table")

    in_position = Output("1", "1 when the target is reached, or the fine loop closed")
    saturated = Output("1", "1 while the motor is at its limit")
    motor = Output("N.m", "motor torque")

    theta = State(0.0, "rad", "table angle x")
    spin = State(0.0, "rad/s", "inertial rate w about the axis")
    filt = State(0.0, "V", "pickoff voltage behind the lag")
    net = State([0.0, 0.0, 0.0], "V", "state of each network")

    gain = Discrete(0.0, "N.m/V", "static gain G of the loop")
    pole = Discrete([0.0, 0.0, 0.0], "rad/s", "pole of each network")
    ratio = Discrete([1.0, 1.0, 1.0], "1", "its gain at high frequency, pole / zero")
    per_lag = Discrete(0.0, "1/s", "1 / lag")
    per_J = Discrete(0.0, "1/(kg.m2)", "1 / J")
    back = Discrete(0.0, "N.m.s/V", "H_g / K_g")
    demand_rate = Discrete(0.0, "N.m/(V.s)", "demand of the compensator by a step of u, per time")
    wave_s = Discrete([0.0, 0.0], "rad", "encoder errors of order 1 and 2, sine part")
    wave_c = Discrete([0.0, 0.0], "rad", "their cosine part")
    reach = Discrete(1e-3, "rad", "largest angle from the mark")
    capture_gain = Discrete(0.0, "N.m/V", "k_p while capturing")
    brake = Discrete(0.0, "N.m.s/rad", "k_d while capturing")
    near = Discrete(0.0, "V", "capture_angle as a pickoff voltage")
    sensed = Discrete(0.0, "V/rad", "pickoff voltage per table angle")
    joint = Discrete(0.0, "rad", "table angle from which on the rate wanted is that of braking (law 1)")
    braked = Discrete(0.0, "rad/s2", "acceleration that braking counts on (law 1)")

    stage = Discrete(DRIVEN, "1", "0 kinematic, 1 capture, 2 fine")
    near_for = Discrete(0.0, "s", "time near null while capturing")
    slow_for = Discrete(0.0, "s", "time near null and slow while capturing")
    demand = Discrete(0.0, "N.m", "demand of the compensator at the end of the step")
    slope = Discrete(0.0, "N.m/s", "its derivative for u = 0")
    load = Discrete(0.0, "N.m", "M_load without noise")
    drag = Discrete(0.0, "N.m", "tachometer torque while capturing")
    push = Discrete(0.0, "N.m", "motor torque at the end of the step")

    # a table turns little in a step: its sine and cosine go on from those at a mark that seldom moves
    mark = Discrete(0.0, "rad", "angle of the mark")
    mark_s = Discrete(0.0, "1", "sine there")
    mark_c = Discrete(1.0, "1", "cosine there")
    fine_s = Discrete(0.0, "rad", "fine encoder error there")
    fine_c = Discrete(0.0, "rad", "its derivative there, per cycle angle")

    motion = SegmentMotion()  # x, v, a: those at the end of the last step, in servo mode too
    base_last = Discrete(0.0, "rad/s", "rate of the base about the axis at the end of the last step")

    def start(self) -> None:
        self.refuse(self.polarity == 0.0, "polarity must be 1 or -1")
        self.refuse(
            self.C_g == 0.0 and (self.stiffness > 0.0 or self.capture == 1.0),
            "stiffness and capture need a damped gyro: with C_g = 0, which integrates the table angle, the static "
            "stiffness is infinite; give the crossover, and capture = 0",
        )
        unset = self.network == 0.0 and self.crossover == 0.0 and self.stiffness == 0.0
        self.refuse(unset, "network 0 needs a crossover or a stiffness")
        w = 100.0 * pi if self.network < 3.0 else 20.0 * pi
        w = self.crossover if self.crossover > 0.0 else w
        # leads: zero w / sqrt(r), pole w sqrt(r); lag-lead (1 + s/w_l) / (1 + 5 s/w_l) with w_l = w / 12
        spread = 2.0 if self.network == 1.0 else sqrt(5.0)
        spread = sqrt(28.0) if self.network == 3.0 else spread
        spread = sqrt(6.5) if self.network == 4.0 else spread
        top = self.K_g * self.H_g
        zero = [w / spread, w / spread, w / spread]
        for k in range(3):
            self.pole[k] = w * spread
        if self.network == 1.0 or self.network == 2.0:
            zero[2] = w / 12.0
            self.pole[2] = w / 60.0
        if self.network == 3.0:
            zero[2] = self.pole[2]  # two leads only
        square = 1.0
        for k in range(3):
            if self.network == 0.0:
                zero[k] = self.zeros[k]
                self.pole[k] = self.poles[k]
            self.ratio[k] = self.pole[k] / zero[k]
            q = w / self.pole[k]
            z = w / zero[k]
            square = square * (1.0 + q * q) / (1.0 + z * z)
        # denominator of L: d[0] s + d[1] s2 + ... with the lag and the poles multiplied in
        d = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
        d[1] = self.viscous * self.C_g + self.H_g * self.H_g
        d[2] = self.J * self.C_g + self.viscous * self.J_g
        d[3] = self.J * self.J_g
        real = d[1] - d[3] * w * w
        square = square * (real * real + d[2] * d[2] * w * w) * (1.0 + self.lag * self.lag * w * w)
        self.gain = w * sqrt(square) / top
        if self.stiffness > 0.0:
            self.gain = self.stiffness * self.C_g / top
        self.per_lag = 1.0 / self.lag
        self.per_J = 1.0 / self.J
        self.back = self.H_g / self.K_g
        self.demand_rate = self.gain * self.ratio[0] * self.ratio[1] * self.ratio[2] / self.lag
        n = [self.gain * top, 0.0, 0.0, 0.0]
        for j in range(6):
            d[6 - j] = d[6 - j] + d[5 - j] * self.lag
        for k in range(3):
            for j in range(3):
                n[3 - j] = n[3 - j] + n[2 - j] / zero[k]
            for j in range(7):
                d[7 - j] = d[7 - j] + d[6 - j] / self.pole[k]
        for k in range(4):
            d[k] = d[k] + n[k]
        # Routh's table of d: all poles to the left while its first column stays positive
        upper = [d[7], d[5], d[3], d[1], 0.0]
        lower = [d[6], d[4], d[2], d[0], 0.0]
        for _k in range(6):
            self.refuse(
                lower[0] <= 0.0,
                "the loop is unstable with network {network} and a gyro of J_g = {J_g}, C_g = {C_g}: networks are per "
                "gyro time constant (1: 0.4 ms, 2: 1 ms, 3 and 4: undamped), and stiffness has a lower limit too",
            )
            q = upper[0] / lower[0]
            for j in range(4):
                below = upper[j + 1] - q * lower[j + 1]
                upper[j] = lower[j]
                lower[j] = below
        sensitivity = top / self.C_g if self.C_g > 0.0 else self.K_g  # V per rad of table angle
        self.capture_gain = self.J * self.capture_rate * self.capture_rate / sensitivity
        self.brake = 2.0 * self.J * self.capture_rate * self.capture_damping
        self.near = self.capture_angle * sensitivity
        self.sensed = sensitivity
        self.braked = self.capture_share * self.torque_max / self.J
        share = self.capture_rate / (2.0 * self.capture_damping)  # k_p / k_d
        self.joint = 0.5 * self.braked / (share * share)
        wide = self.capture == 1.0 and self.gain * self.near > 2.0 * self.torque_max
        self.refuse(wide, "capture_angle = {capture_angle} rad is beyond the linear range, torque_max / K_T")
        for k in range(2):
            self.wave_s[k] = self.encoder_amplitude[k] * cos(self.encoder_phase[k])
            self.wave_c[k] = self.encoder_amplitude[k] * sin(self.encoder_phase[k])
        self.reach = 1e-3 / self.encoder_fine if self.encoder_amplitude[2] != 0.0 else 1e-3
        self.mark = self.angle0
        self.mark_s = sin(self.mark)
        self.mark_c = cos(self.mark)
        self.fine_s = self.encoder_amplitude[2] * sin(self.encoder_fine * self.mark + self.encoder_phase[2])
        self.fine_c = self.encoder_amplitude[2] * cos(self.encoder_fine * self.mark + self.encoder_phase[2])
        self.motion.rest(self.angle0)
        self.theta = self.angle0
        self.spin = self.earth()
        self.base_last = self.earth()

    def earth(self) -> Number:
        """Return the inertial rate of the base along the axis."""
        return self.tilted[2] @ self.omega_local

    def shaped(self, demand: Number) -> Number:
        m = clip(demand, -self.torque_max, self.torque_max)
        return m if self.shaper == 1.0 else m * fabs(m) / self.torque_max

    def sine(self, d: Number) -> Number:  # of a small angle: up to reach, 1e-3, exact to the last digit
        return d - d * d * d * (SIXTH - d * d / 120.0)

    def cosine_less_one(self, d: Number) -> Number:
        return d * d * (d * d / 24.0 - 0.5)

    def sine_now(self) -> Number:
        d = self.theta - self.mark
        return self.mark_s + (self.mark_s * self.cosine_less_one(d) + self.mark_c * self.sine(d))

    def cosine_now(self) -> Number:
        d = self.theta - self.mark
        return self.mark_c + (self.mark_c * self.cosine_less_one(d) - self.mark_s * self.sine(d))

    def pulled(self, volt: Number) -> Number:
        """Return the torque of the capture law by the angle alone, that of the tachometer not counted."""
        limit = self.brake * self.capture_speed
        if self.capture_law < 1.0:
            return clip(-self.capture_gain * volt, -limit, limit)
        e = fabs(volt) / self.sensed
        wanted = self.capture_gain * fabs(volt)
        if e > self.joint:
            wanted = self.brake * sqrt(2.0 * self.braked * e) - self.capture_gain * self.joint * self.sensed
        return -wanted if volt > 0.0 else wanted

    def flow(self) -> None:
        slip = self.spin - 0.5 * (self.base_last + self.earth())  # a base that moves: its mean over the step
        volt = self.polarity * self.u if self.stage == FINE else 0.0
        fast = (volt - self.filt) * self.per_lag
        self.der.filt = fast
        y = self.filt
        for k in range(3):
            lead = y - self.net[k]
            self.der.net[k] = self.pole[k] * lead
            y = self.net[k] + self.ratio[k] * lead
        m = -self.gain * y
        # what the motor gives beyond the linear law, at mid-step, from held values: nothing of it enters the Jacobian
        if self.stage == FINE:
            middle = self.demand + 0.5 * self.h * (self.slope - self.demand_rate * volt)
            m = m + (self.shaped(middle) - middle)
        if self.stage == CAPTURE:
            capture = self.pulled(self.polarity * self.u) + self.drag
            m = m + clip(capture, -self.torque_max, self.torque_max)
        m = m + self.load + self.torque + self.noise.rumble - self.viscous * slip
        self.der.spin = (m - self.back * fast) * self.per_J
        self.der.theta = slip

    @sampled(every=1)
    def tick(self) -> None:
        if self.motion.commanded(self.mode, self.target):
            known = self.mode == 0.0 or self.mode == 1.0 or self.mode == 2.0 or self.mode == 3.0
            self.refuse(not known, "mode = {mode} must be 0 hold, 1 index, 2 rate or 3 servo")
            wild = self.mode == 2.0 and fabs(self.target) > self.rate_max
            self.refuse(wild, "rate {target} rad/s exceeds rate_max = {rate_max} rad/s")
            if self.mode != 3.0:
                self.stage = DRIVEN
                self.motion.plan(self.mode, self.target, self.acceleration, self.index_rate)
            elif self.stage == DRIVEN:
                self.stage = CAPTURE
                self.near_for = 0.0
                self.slow_for = 0.0
            self.motion.mode_last = self.mode
            self.motion.target_last = self.target

        if self.stage == DRIVEN:
            self.motion.advance()
            self.theta = self.motion.x
            self.spin = self.earth() + self.motion.v
        self.base_last = self.earth()

        if fabs(self.theta - self.mark) > self.reach:
            self.mark = self.theta
            self.mark_s = sin(self.mark)
            self.mark_c = cos(self.mark)
            if self.encoder_amplitude[2] != 0.0:
                phase = self.encoder_fine * self.mark + self.encoder_phase[2]
                self.fine_s = self.encoder_amplitude[2] * sin(phase)
                self.fine_c = self.encoder_amplitude[2] * cos(phase)

    @sampled(every=1)
    def servo(self) -> None:
        volt = self.polarity * self.u
        ready = 0.0
        if self.stage == CAPTURE:
            near = fabs(self.u) < self.near
            slow = fabs(self.u) < self.near and fabs(self.spin) < self.capture_slow
            self.near_for = self.near_for + self.h if near else 0.0
            self.slow_for = self.slow_for + self.h if slow else 0.0
            # w - omega_d is -u' over the sensitivity: its mean in near_for is at most 2 capture_angle / near_for
            still = self.near_for >= maximum(2.0 * self.capture_angle / self.capture_slow, self.capture_hold)
            if self.capture == 0.0 or (slow and self.slow_for >= self.capture_hold) or (near and still):
                ready = 1.0
                self.stage = FINE
        if self.stage != FINE or ready == 1.0:  # the networks at rest at 0, or preset to what they will see
            self.filt = ready * volt
            for k in range(3):
                self.net[k] = ready * volt
        self.load = 0.0
        self.push = 0.0
        self.demand = 0.0
        if self.stage == DRIVEN:
            return
        slip = self.spin - self.earth()
        if self.friction > 0.0:
            self.load = -self.friction * tanh(slip / maximum(self.friction_rate, 2.0 * self.h * self.friction / self.J))
        if self.ripple > 0.0:
            self.load = self.load + self.ripple * sin(self.ripple_cycles * self.theta + self.ripple_phase)
        if self.unbalance[0] != 0.0 or self.unbalance[1] != 0.0:
            g = self.tilted @ self.f_local
            fx = self.cosine_now() * g[0] + self.sine_now() * g[1]
            fy = self.cosine_now() * g[1] - self.sine_now() * g[0]
            self.load = self.load - (self.unbalance[0] * fy - self.unbalance[1] * fx)
        others = self.load + self.torque - self.viscous * slip
        if self.stage == FINE:
            fast = -self.filt * self.per_lag
            y = self.filt
            dy = fast
            for k in range(3):
                lead = y - self.net[k]
                d = self.pole[k] * lead
                y = self.net[k] + self.ratio[k] * lead
                dy = d + self.ratio[k] * (dy - d)
            self.demand = -self.gain * y
            self.slope = -self.gain * dy
            self.push = self.shaped(self.demand)
            others = others - self.back * (volt * self.per_lag + fast)
        else:
            self.drag = -self.brake * self.spin
            capture = self.pulled(volt) + self.drag
            self.push = clip(capture, -self.torque_max, self.torque_max)
        self.motion.a = (self.push + others) * self.per_J
        self.motion.x = self.theta
        self.motion.v = slip
        self.motion.t_last = self.t
        self.motion.arrived = 1.0 if self.stage == FINE else 0.0

    def outputs(self) -> None:
        s = self.sine_now()
        c = self.cosine_now()
        read = self.theta + self.wave_s[0] * s + self.wave_c[0] * c
        read = read + 2.0 * s * (self.wave_s[1] * c - self.wave_c[1] * s) + self.wave_c[1]
        if self.encoder_amplitude[2] != 0.0:
            d = self.encoder_fine * (self.theta - self.mark)
            read = read + (self.fine_s + (self.fine_s * self.cosine_less_one(d) + self.fine_c * self.sine(d)))
        if self.quantum > 0.0:
            read = self.quantum * floor(read / self.quantum + 0.5)
        rate = self.spin - self.earth()
        self.feel(c, s, self.spin, rate, self.motion.a)
        self.angle = self.theta
        self.rate = rate
        self.angle_read = read
        self.in_position = self.motion.arrived
        self.motor = self.push
        self.saturated = 1.0 if fabs(self.demand) > self.torque_max else 0.0
