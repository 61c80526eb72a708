"""Drift of gyros, and what the single-degree-of-freedom gyros share."""

from __future__ import annotations

from gyrobench.component.blocks.random_drift import Flicker, Quantization, RateRandomWalk
from gyrobench.component.component import Component
from gyrobench.component.composition import Block, sampled
from gyrobench.component.declarations import Discrete, Input, Noise, Output, Parameter, State
from gyrobench.component.math import Number, Vector, clip, exp, fabs, pi, sqrt, vector
from gyrobench.component.rotation import Rotation
from gyrobench.component.set_up import GYRO_MOUNT, turned

DEG_H = pi / 180.0 / 3600.0  # 1 deg/h in rad/s
PER_G = -1.0 / 9.80665  # (X, Y, Z) = PER_G f, s2/m


def drift_polynomial(fixed: Number, linear: Vector, square: Vector, x: Vector) -> Number:
    """Return fixed + linear . x + D_11 x1 x1 + D_22 x2 x2 + D_33 x3 x3 + D_12 x1 x2 + D_23 x2 x3 + D_13 x1 x3.

    square: (D_11, D_22, D_33, D_12, D_23, D_13).  [GYRO-STATIC-10; Hu 1981, eq. 2-36]
    """
    first = linear[0] + square[0] * x[0] + square[3] * x[1] + square[5] * x[2]
    second = linear[1] + square[1] * x[1] + square[4] * x[2]
    third = linear[2] + square[2] * x[2]
    return fixed + first * x[0] + second * x[1] + third * x[2]


def torquer_rate(k: Number, k2: Number, k3: Number, i: Number) -> Number:
    """Return the precession rate of a torquer at the current i: k i (1 + k2 i + k3 i2)."""
    return k * i * (1.0 + k2 * i + k3 * i * i)


class GaussMarkov(Block):
    """First-order Gauss-Markov process, stationary from the start, held over an internal step.  [DRIFT-RANDOM-CLASSES]

    value+ = e^(-h/tau) value + sqrt(1 - e^(-2 h/tau)) rms xi
    """

    suffixes = {"rms": ""}
    rms = Noise(0.0, "1", "rms of the Gauss-Markov process", per="step")
    tau = Parameter(300.0, "s", "its correlation time", above=0.0)
    value = Discrete(0.0, "1", "Gauss-Markov process")
    decay = Discrete(0.0, "1", "its decay in one internal step")
    innovation = Discrete(0.0, "1", "size of its innovation")
    h_last = Discrete(0.0, "s", "internal step they were made for")

    def __init__(self, rms: float, unit: str, what: str, size: str = "", tau: float | str = 300.0) -> None:
        """what: "Gauss-Markov drift"; size: the default in words; tau: s, or the name of a parameter that is shared."""
        shown = f" ({size})" if size else ""
        shared = tau if isinstance(tau, str) else Parameter(tau, "s", f"correlation time of the {what}", above=0.0)
        super().__init__(
            rms=Noise(rms, unit, f"rms of the {what}{shown}", per="step"), tau=shared, value=Discrete(0.0, unit, what)
        )

    def start(self) -> None:
        self.value = self.noise.rms
        self.h_last = 0.0

    @sampled(every=1)
    def tick(self) -> None:
        if self.h != self.h_last:
            self.decay = exp(-self.h / self.tau)
            self.innovation = sqrt(1.0 - self.decay * self.decay)
            self.h_last = self.h
        self.value = self.decay * self.value + self.innovation * self.noise.rms


class Exposure(Block):
    """Drift rate that temperature and magnetic field add, linear in both.  [ENV-DISTURBANCE]

        T (temperature) + B . (field) + dB . (differences of the field over the length of the gyro)

    temperature: mean of the gyro, K above the temperature that its coefficients belong to; field in T along the axes of
    the gyro.  With all of them 0, as they are unless set, nothing is computed.
    """

    T = Parameter(0.0, "rad/s/K", "drift rate per kelvin of mean temperature")
    B = Parameter([0.0, 0.0, 0.0], "rad/s/T", "drift rate per magnetic field along each axis")
    dB = Parameter([0.0, 0.0, 0.0], "rad/s/T", "drift rate per difference of the magnetic field along each axis")
    exposed = Discrete(0.0, "1", "1 where one of these sensitivities is given")

    def start(self) -> None:
        self.exposed = 1.0 if self.T != 0.0 else 0.0
        for j in range(3):
            if self.B[j] != 0.0 or self.dB[j] != 0.0:
                self.exposed = 1.0

    def added(self, temperature: Number, field: Vector, difference: Vector) -> Number:
        """Return the drift rate that the surroundings add."""
        return self.T * temperature + vector(self.B) @ field + vector(self.dB) @ difference


class ChannelSupply(Block):
    """Drift of one channel of a two-degree-of-freedom gyro that its supplies add.  [GYRO-SUPPLY]

    D_0 + pickoff ((1 + e)2 - 1) + torquer ((1 + a)2 - 1)
    D_own + voltage v + phase p,   D_z + voltage_z v + phase_z p      own: x of the x, y of the y channel
    """

    pickoff = Parameter(0.0, "rad/s", "part of the constant drift that the reaction torque of the pickoff makes")
    torquer = Parameter(0.0, "rad/s", "part of the constant drift that the reaction torque of the torquer makes")
    voltage = Parameter(0.0, "rad/s", "drift per g0 along the channel's axis and relative change of the wheel voltage")
    voltage_z = Parameter(0.0, "rad/s", "drift per g0 along z and relative change of the wheel voltage")
    phase = Parameter(0.0, "rad/s", "drift per g0 along the channel's axis and radian of asymmetry of the phases")
    phase_z = Parameter(0.0, "rad/s", "drift per g0 along z and radian of asymmetry of the phases")

    def sensitivity(self) -> Number:
        """Return 0 where none of them is given."""
        return (
            fabs(self.pickoff)
            + fabs(self.torquer)
            + fabs(self.voltage)
            + fabs(self.voltage_z)
            + fabs(self.phase)
            + fabs(self.phase_z)
        )

    def added(self, own: Number, z: Number, wheel: Vector, excitation: Vector) -> Number:
        """Return it; own, z: g along these axes; wheel: (v, p); excitation: (e, a)."""
        e = excitation[0]
        a = excitation[1]
        reaction = self.pickoff * e * (2.0 + e) + self.torquer * a * (2.0 + a)
        along = (self.voltage * wheel[0] + self.phase * wheel[1]) * own
        return reaction + along + (self.voltage_z * wheel[0] + self.phase_z * wheel[1]) * z


class ChannelDrift(Block):
    """Static drift of one channel of a two-degree-of-freedom gyro, ten terms along x, y, z.  [GYRO-STATIC-2DOF]

    terms says which model is meant: 8 = without empirical terms, 9 = 8 + per g0 along `empirical`, 10 = 9 + its square.
    p0, px, py, pz: ageing of the constant and the linear coefficients, relative; Tx, Ty, Tz: change of the linear ones
    with the temperature difference that belongs to each; vx, vy, vz: drift per velocity of the float against the case.
    [GYRO-COEFF-TIME-TEMP; Hu 1981, eq. 2-39..2-42]
    """

    suffixes = {"fixed": "0", "exposure": "", "supply": ""}
    exposure = Exposure()
    supply = ChannelSupply()
    fixed = Parameter(0.0, "rad/s", "constant drift")
    x = Parameter(0.0, "rad/s", "per g0 along x")
    y = Parameter(0.0, "rad/s", "per g0 along y")
    z = Parameter(0.0, "rad/s", "per g0 along z")
    xx = Parameter(0.0, "rad/s", "per g0 squared along x")
    yy = Parameter(0.0, "rad/s", "per g0 squared along y")
    zz = Parameter(0.0, "rad/s", "per g0 squared along z")
    xy = Parameter(0.0, "rad/s", "per g0 squared, x and y")
    yz = Parameter(0.0, "rad/s", "per g0 squared, y and z")
    xz = Parameter(0.0, "rad/s", "per g0 squared, x and z")
    p0 = Parameter(0.0, "1/s", "ageing of the constant drift")
    px = Parameter(0.0, "1/s", "ageing along x")
    py = Parameter(0.0, "1/s", "ageing along y")
    pz = Parameter(0.0, "1/s", "ageing along z")
    Tx = Parameter(0.0, "rad/s/K", "per g0 along x and temperature difference")
    Ty = Parameter(0.0, "rad/s/K", "per g0 along y and temperature difference")
    Tz = Parameter(0.0, "rad/s/K", "per g0 along z and temperature difference")
    vx = Parameter(0.0, "rad/m", "per velocity of the float along x")
    vy = Parameter(0.0, "rad/m", "per velocity of the float along y")
    vz = Parameter(0.0, "rad/m", "per velocity of the float along z")

    def __init__(self, channel: str, differences: str, **values: tuple[float, str]) -> None:
        """differences: axes of the temperature differences of Tx, Ty, Tz.  values: coefficient -> (deg/h, meaning)."""
        said = {n: Parameter(v * DEG_H, "rad/s", f"{channel} channel, {doc}") for n, (v, doc) in values.items()}
        for name, of in (("p0", f"D{channel}_0"), *((f"p{a}", f"D{channel}_{a}") for a in "xyz")):
            said[name] = Parameter(0.0, "1/s", f"ageing of {of}, relative")
        for axis, along in zip("xyz", differences, strict=True):
            text = f"{channel} channel, per g0 along {axis} and temperature difference along {along}"
            said[f"T{axis}"] = Parameter(0.0, "rad/s/K", text)
            said[f"v{axis}"] = Parameter(0.0, "rad/m", f"{channel} channel, per velocity of the float along {axis}")
        super().__init__(**said)

    def rate(self, g: Vector, age: Number, dT: Vector, v: Vector) -> Number:
        """Return the drift rate for (X, Y, Z) = g; dT: signed temperature differences that belong to Tx, Ty, Tz."""
        fixed = self.fixed * (1.0 + self.p0 * age) + (self.vx * v[0] + self.vy * v[1] + self.vz * v[2])
        along_x = self.x * (1.0 + self.px * age) + self.Tx * dT[0]
        along_y = self.y * (1.0 + self.py * age) + self.Ty * dT[1]
        along_z = self.z * (1.0 + self.pz * age) + self.Tz * dT[2]
        square = vector([self.xx, self.yy, self.zz, self.xy, self.yz, self.xz])
        return drift_polynomial(fixed, vector([along_x, along_y, along_z]), square, g)

    def surroundings(self, temperature: Number, field: Vector, difference: Vector) -> Number:
        """Return the drift rate that the surroundings add."""
        return self.exposure.added(temperature, field, difference)

    def sensitivity(self) -> Number:
        """Return 0 where the supplies add nothing."""
        return self.supply.sensitivity()

    def supplies(self, own: Number, z: Number, wheel: Vector, excitation: Vector) -> Number:
        """Return the drift rate that the supplies add."""
        return self.supply.added(own, z, wheel, excitation)


class SdfGyro(Component):
    """Common part of single-degree-of-freedom gyros: float, pickoff, torquer, mount, static and random drift, ports.

        omega_d = D_F + D_I X + D_O Y + D_S Z + D_II X2 + D_OO Y2 + D_SS Z2 + D_IO X Y + D_OS Y Z + D_IS X Z
                  + D_T T + D_B . B + D_dB . dB + turn-on bias + Gauss-Markov + white
                  + flicker + random walk + ramp t + quantization                             [DRIFT-RANDOM-ALLAN]
        (X, Y, Z) = -f/g0 along I, O, S; T: mean temperature above that of the coefficients; B, dB: magnetic field
        torquer: precession rate k (1 + k_T T) i (1 + k2 i + k3 i2)
        u = K_sg b + noise, limited to +-u_max

    Axes I, O, S (input, output, spin reference) are those of the mount: v_gyro = mount v_case.  [GYRO-STATIC-10]
    """

    H = Parameter(0.2, "N.m.s", "spin angular momentum", above=0.0)
    J = Parameter(2e-4, "kg.m2", "float inertia about the output axis", above=0.0)
    K_sg = Parameter(10.0, "V/rad", "pickoff gain", above=0.0)
    u_max = Parameter(0.1, "V", "pickoff saturation", above=0.0)
    k = Parameter(17.2e3 * DEG_H, "rad/s/A", "torquer scale factor (17.2 deg/h/mA)", above=0.0)
    k2 = Parameter(0.0, "1/A", "torquer nonlinearity, relative, even in the rate")
    k3 = Parameter(0.0, "1/A2", "torquer nonlinearity, relative, odd in the rate")
    k_T = Parameter(0.0, "1/K", "torquer scale factor per kelvin of mean temperature, relative")
    simulates = (turned("mount", GYRO_MOUNT),)
    mount = Rotation("rows: gyro axes I, O, S in case axes")

    D_F = Parameter(-0.3 * DEG_H, "rad/s", "acceleration-insensitive drift rate (-0.3 deg/h)")
    D_I = Parameter(-0.9 * DEG_H, "rad/s", "drift rate per g0 along I, mass unbalance along S (-0.9 deg/h/g)")
    D_O = Parameter(0.1 * DEG_H, "rad/s", "drift rate per g0 along O, empirical (0.1 deg/h/g)")
    D_S = Parameter(-0.7 * DEG_H, "rad/s", "drift rate per g0 along S, mass unbalance along I (-0.7 deg/h/g)")
    D_II = Parameter(-0.05 * DEG_H, "rad/s", "drift rate per g0 squared along I (-0.05 deg/h/g2)")
    D_OO = Parameter(0.0, "rad/s", "drift rate per g0 squared along O, empirical")
    D_SS = Parameter(0.04 * DEG_H, "rad/s", "drift rate per g0 squared along S (0.04 deg/h/g2)")
    D_IO = Parameter(-0.03 * DEG_H, "rad/s", "drift rate per g0 squared, I and O (-0.03 deg/h/g2)")
    D_OS = Parameter(-0.02 * DEG_H, "rad/s", "drift rate per g0 squared, O and S (-0.02 deg/h/g2)")
    D_IS = Parameter(-0.15 * DEG_H, "rad/s", "drift rate per g0 squared, I and S, anisoelasticity (-0.15 deg/h/g2)")

    D = Exposure()

    turn_on = Noise(0.0, "rad/s", "rms of the turn-on bias, one value a run", per="start")
    markov = GaussMarkov(0.002 * DEG_H, "rad/s", "Gauss-Markov drift", "0.002 deg/h")
    white = Noise(0.0178 * DEG_H, "rad/s/sqrt(Hz)", "white drift density (0.0178 deg/h/sqrt(Hz))")
    pickoff = Noise(5e-8, "V/sqrt(Hz)", "pickoff noise density")
    flicker = Flicker("rad/s", "drift")
    walk = RateRandomWalk("rad/s", "rad/s2/sqrt(Hz)", "drift")
    quantization = Quantization("drift")
    ramp = Parameter(0.0, "rad/s2", "ramp of the drift, coefficient R")
    wanders = Discrete(0.0, "1", "1 where one of these four is given")

    omega = Input([0.0, 0.0, 0.0], "rad/s", "inertial rate, case axes")
    alpha = Input([0.0, 0.0, 0.0], "rad/s2", "angular acceleration, case axes")
    f = Input([0.0, 0.0, 0.0], "m/s2", "specific force a - G, case axes")
    i = Input(0.0, "A", "torquer current")
    temperature = Input(0.0, "K", "mean temperature above that of the coefficients")
    B = Input([0.0, 0.0, 0.0], "T", "magnetic field, case axes")
    dB = Input([0.0, 0.0, 0.0], "T", "differences of the magnetic field over the gyro, case axes")

    u = Output("V", "pickoff voltage")
    drift = Output("rad/s", "drift rate omega_d, precession sign")
    b = Output("rad", "float angle")
    saturated = Output("1", "1 while the pickoff is saturated")

    float_angle = State(0.0, "rad", "float angle b about O relative to the case")
    float_rate = State(0.0, "rad/s", "its rate r")

    def start(self) -> None:
        self.wanders = 0.0
        if self.flicker > 0.0 or self.walk > 0.0 or self.quantization > 0.0 or self.ramp != 0.0:
            self.wanders = 1.0

    def polynomial(self, fixed: Number, linear: Vector, x: Vector) -> Number:
        return drift_polynomial(
            fixed, linear, vector([self.D_II, self.D_OO, self.D_SS, self.D_IO, self.D_OS, self.D_IS]), x
        )

    def static_drift(self, x: Vector) -> Number:
        return self.polynomial(self.D_F, vector([self.D_I, self.D_O, self.D_S]), x)

    def drift_rate(self) -> Number:
        """Return omega_d: static, of the surroundings, and random."""
        static = self.static_drift(PER_G * (self.mount @ self.f))
        if self.D_exposed > 0.0:
            static = static + self.D.added(self.temperature, self.mount @ self.B, self.mount @ self.dB)
        rate = static + self.noise.turn_on + self.markov_value + self.noise.white
        if self.wanders > 0.0:
            rate = rate + self.flicker_value + self.walk_value + self.quantization_rate + self.ramp * self.t
        return rate

    def precession(self) -> Number:
        """Return the precession rate by the torquer."""
        return torquer_rate(self.k * (1.0 + self.k_T * self.temperature), self.k2, self.k3, self.i)

    def gain(self) -> Number:
        """Return the gain of the pickoff, V/rad."""
        return self.K_sg

    def outputs(self) -> None:
        self.drift = self.drift_rate()
        self.b = self.float_angle
        unlimited = self.gain() * self.float_angle + self.noise.pickoff
        self.u = clip(unlimited, -self.u_max, self.u_max)
        self.saturated = 1.0 if self.u != unlimited else 0.0
