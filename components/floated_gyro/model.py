from __future__ import annotations

from gyrobench.component import Discrete, Input, Output, Parameter, sampled
from gyrobench.component.blocks.supply import SuppliedGyro
from gyrobench.component.math import Number, Vector, cos, fabs, pi, sin, vector


class FloatedGyro(SuppliedGyro):
    """Single-degree-of-freedom floated gyro.  [GYRO-DYN-1, GYRO-SDF-EOM, GYRO-STATIC-10, GYRO-COEFF-TIME-TEMP]

    Rate-integrating with K = 0; integrating with C = 0 as well; with a spring K > 0 a rate gyro.

    Axes I, O, S (input, output, spin reference) are those of the mount: v_gyro = mount v_case.

        b' = r,   J r' = -C r - K b + H (w_I' - omega_d - k i (1 + k2 i + k3 i2)) - J alpha_O + M_dyn
        u = K_sg b + noise, limited to +-u_max                         [GYRO-DYN-1; Hu 1981, eq. 2-50..2-56]

    b is the float angle, w_I' = w_I cos b - w_S sin b, w_S' = w_I sin b + w_S cos b.  In the steady state of a
    rebalance loop k i (1 + k2 i + k3 i2) = omega_IA - omega_d.
    Drift rate omega_d in precession sign, (X, Y, Z) = -f/g0 along I, O, S, g0 = 9.80665 m/s2   [2-36, 2-47..2-49]

        omega_d = F + X I + Y O + Z S + D_II X2 + D_OO Y2 + D_SS Z2 + D_IO X Y + D_OS Y Z + D_IS X Z
                  + D_T T_m + D_B . B + D_dB . dB + turn-on constant + Gauss-Markov + white
                  + flicker + random walk + ramp t + quantization                             [DRIFT-RANDOM-ALLAN]
        F = D_F (1 + p_F T) + D_vI v_I + D_vO v_O + D_vS v_S
                                                     I = D_I (1 + p_I T) + D_TI dT_S
        O = D_O (1 + p_O T) - D_TO dT_O              S = D_S (1 + p_S T) - D_TS dT_I        T = age + time

    The second block is Hu 1981, eq. 2-39..2-42, which stands in torque sign omega_M = -omega_d, with every
    coefficient's sign turned: D_F = -D_K, D_I = -U_z, D_O = -U_y, D_S = +U_x, and of the thermal terms
    -D_Tzx dT_z X -> +D_TI dT_S X, +D_Tyy dT_y Y -> -D_TO dT_O Y, +D_Txz dT_x Z -> -D_TS dT_I Z.  dT_j is the
    temperature difference between the two ends of the float along j, v_j the velocity of the float against the case
    (D_vI = -D_vx, D_vO = -D_vy, D_vS = -D_vz of Hu 1981).  p_O has no physical cause there.
    T_m (input `temperature`): mean temperature of the gyro above the one that the coefficients belong to; it also turns
    k into k (1 + k_T T_m).  B, dB: magnetic field along I, O, S, and its differences over the gyro  [ENV-DISTURBANCE]

    `terms` says which model is meant: 3 = F, I, S; 4 = 3 + IS; 5 = 4 + II; 8 = 5 + SS, IO, OS; 9 = 8 + O;
    10 = 9 + OO.  A coefficient outside it must be 0.  Gauss-Markov: g+ = e^(-h/tau) g + sqrt(1 - e^(-2 h/tau))
    rms xi, stationary from the start, held over each internal step; white drift and pickoff noise by density.
    With the default sizes a 60 s mean scatters by 0.0030 deg/h (white 0.0023, Gauss-Markov 0.0019, pickoff 0.0002).

    Dynamic errors, from Euler's equations of the float with its products of inertia J_xy = integral of x y dm; the
    sign of the cross-coupling -H w_S b is that of w_I', the printed one is wrong            [GYRO-DYNAMIC-ERR]

        M_dyn = dJ w_I' w_S' + J_IO (alpha_I' + w_O w_S') + J_OS (alpha_S' - w_O w_I') + J_SI (w_S'2 - w_I'2)

    Supplies off their nominal values turn H into H (1 + f), which leaves the torques, and add to drift, torquer and
    pickoff; see :class:`gyrobench.component.blocks.supply.SuppliedGyro`                               [GYRO-SUPPLY]

    Torque on the mount, given in case axes: -H (w_O + r) cos b along I, C r + K b + H (omega_d + k i (1 + ...))
    along O, +H (w_O + r) sin b along S.  With h_I = H sin b and M_I = -H w_O cos b it is M_I - h_I' along I: a mount
    that keeps its momentum with h_I in it needs no acceleration of the float.  h_I is given for the middle of the
    coming internal step: held over the step by the mount, it neither drives nor damps the nutation (the map of one
    step has determinant 1).  Computed with reaction = 1 only.
    The run ends where |b| reaches `stop`.

    Not modelled: bearing and rotor compliance (third-order dynamics), nutation, hunting of the wheel, how the float
    comes to move (v_float), vibration, hysteresis and warm-up, contact of the float with its stop, torquer axis error;
    in M_react the float's own inertia about I and S (count it with the mount).
    Source: Hu 1981, ch. 2; Xia 2008, sections 2.1, 2.2.2.2 (corrected).
    """

    version = "1.5.0"

    C = Parameter(0.2, "N.m.s/rad", "float damping; 0: integrating gyro", min=0.0)
    K = Parameter(0.0, "N.m/rad", "spring of the float; above 0: rate gyro", min=0.0)
    stop = Parameter(0.0, "rad", "float stop: the run ends there (0: none)", min=0.0)
    dJ = Parameter(0.0, "kg.m2", "anisoinertia J_S - J_I of the float")
    J_IO = Parameter(0.0, "kg.m2", "product of inertia of the float, I and O")
    J_OS = Parameter(0.0, "kg.m2", "product of inertia of the float, O and S")
    J_SI = Parameter(0.0, "kg.m2", "product of inertia of the float, S and I")
    reaction = Parameter(False, bool, "1: M_react, h_I and M_I are computed; 0: they stay 0, which is quicker")

    terms = Parameter(9, int, "terms of the static model: 3, 4, 5, 8, 9 or 10")
    age = Parameter(0.0, "s", "age at time 0", min=0.0)
    p_F = Parameter(0.0, "1/s", "ageing of D_F, relative (typical 1e-8)")
    p_I = Parameter(0.0, "1/s", "ageing of D_I, relative (typical 1e-8)")
    p_O = Parameter(0.0, "1/s", "ageing of D_O, relative")
    p_S = Parameter(0.0, "1/s", "ageing of D_S, relative (typical 1e-8)")
    D_TI = Parameter(0.0, "rad/s/K", "D_Tzx: drift per g0 along I and temperature difference along S")
    D_TO = Parameter(0.0, "rad/s/K", "D_Tyy: drift per g0 along O and temperature difference along O")
    D_TS = Parameter(0.0, "rad/s/K", "D_Txz: drift per g0 along S and temperature difference along I")

    D_vI = Parameter(0.0, "rad/m", "drift per velocity of the float along I")
    D_vO = Parameter(0.0, "rad/m", "drift per velocity of the float along O")
    D_vS = Parameter(0.0, "rad/m", "drift per velocity of the float along S")

    dT = Input([0.0, 0.0, 0.0], "K", "temperature differences along I, O, S")
    v_float = Input([0.0, 0.0, 0.0], "m/s", "velocity of the float against the case, along I, O, S")

    M_react = Output("N.m", "torque of the gyro on its mount, case axes", shape=(3,))
    h_I = Output("N.m.s", "spin momentum along I, H sin b, half an internal step ahead")
    M_I = Output("N.m", "torque on the mount along I without its part -dh_I/dt")

    dynamic = Discrete(0.0, "1", "1 where a dynamic error is given")

    def start(self) -> None:
        n = self.terms
        self.refuse(
            not (n == 3.0 or n == 4.0 or n == 5.0 or n == 8.0 or n == 9.0 or n == 10.0),
            "terms = {terms} is not a static model: it must be 3, 4, 5, 8, 9 or 10",
        )
        self.refuse(n < 4.0 and self.D_IS != 0.0, "D_IS must be 0 with terms = {terms} (from 4 on)")
        self.refuse(n < 5.0 and self.D_II != 0.0, "D_II must be 0 with terms = {terms} (from 5 on)")
        self.refuse(n < 8.0 and self.D_SS != 0.0, "D_SS must be 0 with terms = {terms} (from 8 on)")
        self.refuse(n < 8.0 and self.D_IO != 0.0, "D_IO must be 0 with terms = {terms} (from 8 on)")
        self.refuse(n < 8.0 and self.D_OS != 0.0, "D_OS must be 0 with terms = {terms} (from 8 on)")
        self.refuse(n < 9.0 and self.D_O != 0.0, "D_O must be 0 with terms = {terms} (from 9 on)")
        self.refuse(n < 10.0 and self.D_OO != 0.0, "D_OO must be 0 with terms = {terms} (from 10 on)")
        self.refuse(self.stop >= 0.5 * pi, "stop = {stop} rad: the float must stop before pi/2")
        self.dynamic = 0.0
        if self.dJ != 0.0 or self.J_IO != 0.0 or self.J_OS != 0.0 or self.J_SI != 0.0:
            self.dynamic = 1.0

    def static_drift(self, x: Vector) -> Number:
        age = self.age + self.t
        v = self.v_float
        fixed = self.D_F * (1.0 + self.p_F * age) + (self.D_vI * v[0] + self.D_vO * v[1] + self.D_vS * v[2])
        along_i = self.D_I * (1.0 + self.p_I * age) + self.D_TI * self.dT[2]
        along_o = self.D_O * (1.0 + self.p_O * age) - self.D_TO * self.dT[1]
        along_s = self.D_S * (1.0 + self.p_S * age) - self.D_TS * self.dT[0]
        drift = self.polynomial(fixed, vector([along_i, along_o, along_s]), x)
        if self.sensitive > 0.0:
            drift = drift + self.by_supplies(x)
        return drift

    def flow(self) -> None:
        w = self.mount @ self.omega
        sensed = w[0] * cos(self.float_angle) - w[2] * sin(self.float_angle)
        rate = self.drift_rate()
        torque = self.H * self.speed() * (sensed - rate - self.precession()) - self.C * self.float_rate
        if self.K > 0.0:
            torque = torque - self.K * self.float_angle
        if self.dynamic > 0.0:
            c = cos(self.float_angle)
            s = sin(self.float_angle)
            a = self.mount @ self.alpha
            spin = w[0] * s + w[2] * c
            torque = torque + self.dJ * sensed * spin + self.J_SI * (spin * spin - sensed * sensed)
            torque = torque + self.J_IO * (a[0] * c - a[2] * s + w[1] * spin)
            torque = torque + self.J_OS * (a[0] * s + a[2] * c - w[1] * sensed)
        self.der.float_angle = self.float_rate
        self.der.float_rate = torque / self.J - self.mount[1] @ self.alpha

    @sampled(every=1)
    def tick(self) -> None:
        if self.stop > 0.0:
            self.refuse(fabs(self.float_angle) >= self.stop, "the float has reached its stop: b = {float_angle} rad")

    def outputs(self) -> None:
        if self.reaction:
            w_o = self.mount[1] @ self.omega
            momentum = self.H * self.speed()
            s = momentum * sin(self.float_angle)
            c = momentum * cos(self.float_angle)
            turn = w_o + self.float_rate
            held = momentum * (self.drift + self.precession())
            along_o = self.C * self.float_rate + self.K * self.float_angle + held
            self.M_react = self.mount[2] * s * turn - self.mount[0] * c * turn + self.mount[1] * along_o
            self.h_I = momentum * sin(self.float_angle + 0.5 * self.h * self.float_rate)
            self.M_I = -c * w_o
