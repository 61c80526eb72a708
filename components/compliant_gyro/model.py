from __future__ import annotations

from gyrobench.component import Parameter, State
from gyrobench.component.blocks.supply import SuppliedGyro
from gyrobench.component.math import cos, sin


class CompliantGyro(SuppliedGyro):
    """Floated gyro with elastic rotor bearing and gimbal: third-order dynamics.  [GYRO-DYN-3, GYRO-STATIC-10]

    Axes I, O, S are those of the mount, v_gyro = mount v_case.  The rotor axis turns by x against the case about I and
    by y against the float about O, held there by the stiffnesses K_I and K_O; b = float angle, r its rate:

        H x' = K_O y - H (w_I cos b - w_S sin b)              H y' = -K_I x - H (r + w_O)
        b' = r,   J r' = -C r + K_O y - H (omega_d + k i (1 + k2 i + k3 i2)) - J alpha_O
        u = K_sg b + noise, limited to +-u_max                                     [GYRO-DYN-3; Hu 1981, eq. 2-57..2-67]

    In the rotor angles of GYRO-DYN-3, a, beta and case angles theta: x = a - theta_I, y = beta - b - theta_O.
    As transfer functions, with tau = J/C + H2/(K_I C) and D(s) = H2 J/(K_I K_O C) s3 + H2/(K_I K_O) s2 + tau s + 1:

        b / theta_I = (H/C) / D         b / theta_O = -[H2 J/(K_I K_O C) s3 + tau s] / D
        b / M = (1 + H2 s2/(K_I K_O)) / (C s D),   M = torque on the float

    K_I, K_O -> infinity is floated_gyro.  Same ports, same steady state: k i (1 + k2 i + k3 i2) = omega_IA - omega_d.
    Drift rate omega_d in precession sign as there, (X, Y, Z) = -f/g0 along I, O, S, g0 = 9.80665 m/s2:

        omega_d = D_F + D_I X + D_O Y + D_S Z + D_II X2 + D_OO Y2 + D_SS Z2 + D_IO X Y + D_OS Y Z + D_IS X Z
                  + D_T T_m + D_B . B + D_dB . dB + turn-on constant + Gauss-Markov + white
                  + flicker + random walk + ramp t + quantization                             [DRIFT-RANDOM-ALLAN]

    All ten terms may be given; there is no choice of `terms`, no ageing and no temperature differences (use
    floated_gyro).  T_m, k_T, B and dB as there.

    Supplies off their nominal values turn H into H (1 + f), which leaves the torques on the float, and add to drift,
    torquer and pickoff; see :class:`gyrobench.component.blocks.supply.SuppliedGyro`                     [GYRO-SUPPLY]

    Not modelled: transverse inertia of the rotor (nutation; 1e-6 kg.m2 changes the response at 10 Hz by less than
    1e-3), drift torque on the rotor instead of the float, damping in the bearing, and what floated_gyro leaves out.
    Source: Hu 1981, ch. 2, eq. 2-57..2-67.
    """

    version = "1.3.0"

    C = Parameter(0.2, "N.m.s/rad", "float damping", above=0.0)
    K_I = Parameter(400.0, "N.m/rad", "stiffness of rotor bearing and gimbal about I", above=0.0)
    K_O = Parameter(2000.0, "N.m/rad", "stiffness of rotor bearing and gimbal about O", above=0.0)

    rotor_I = State(0.0, "rad", "rotor axis against the case about I, x")
    rotor_O = State(0.0, "rad", "rotor axis against the float about O, y")

    def flow(self) -> None:
        w = self.mount @ self.omega
        momentum = self.H * self.speed()
        sensed = w[0] * cos(self.float_angle) - w[2] * sin(self.float_angle)
        spring = self.K_O * self.rotor_O  # torque of the rotor on the float
        self.der.rotor_I = spring / momentum - sensed
        self.der.rotor_O = -self.K_I / momentum * self.rotor_I - self.float_rate - w[1]
        self.der.float_angle = self.float_rate
        rate = self.drift_rate() + self.precession()
        torque = spring - momentum * rate - self.C * self.float_rate
        self.der.float_rate = torque / self.J - self.mount[1] @ self.alpha
