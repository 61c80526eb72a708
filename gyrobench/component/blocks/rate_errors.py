"""Errors of a measured rate: static drift by the specific force, dynamic errors by angular motion."""

from __future__ import annotations

from gyrobench.component.blocks.gyro import PER_G, drift_polynomial
from gyrobench.component.composition import Block
from gyrobench.component.declarations import Parameter
from gyrobench.component.math import Number, Vector, vector

#: rows I, O, S of gyros whose input axes are y, z; that of x is not turned
ALONG_Y = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]
ALONG_Z = [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]


class RateErrors(Block):
    """Errors of the rate that a gyro in its rebalance loop, or a rate gyro, indicates.

        indicated = w_I - omega_d + delta
        omega_d   = D_F + D_I X + D_O Y + D_S Z + D_II X2 + ... + D_IS X Z,      (X, Y, Z) = -f/g0 along I, O, S
        delta     = -J a_O + (dJ - HK) w_S w_I + J_IO (a_I + w_O w_S) + J_OS (a_S - w_I w_O) + J_SI (w_S2 - w_I2)

    J, dJ = J_S - J_I and the products of inertia are divided by H; HK = H/K of a spring or of a rebalance loop of that
    stiffness, 0 where the loop integrates.  The cross-coupling -HK w_S w_I is printed with the other sign.
    [GYRO-STATIC-ERR, GYRO-DYNAMIC-ERR; Xia 2008, eq. 2.2.3, 2.2.11, corrected by EX4, EX5]
    """

    D_F = Parameter(0.0, "rad/s", "acceleration-insensitive drift rate")
    D_I = Parameter(0.0, "rad/s", "drift rate per g0 along I")
    D_O = Parameter(0.0, "rad/s", "drift rate per g0 along O")
    D_S = Parameter(0.0, "rad/s", "drift rate per g0 along S")
    D_II = Parameter(0.0, "rad/s", "drift rate per g0 squared along I")
    D_OO = Parameter(0.0, "rad/s", "drift rate per g0 squared along O")
    D_SS = Parameter(0.0, "rad/s", "drift rate per g0 squared along S")
    D_IO = Parameter(0.0, "rad/s", "drift rate per g0 squared, I and O")
    D_OS = Parameter(0.0, "rad/s", "drift rate per g0 squared, O and S")
    D_IS = Parameter(0.0, "rad/s", "drift rate per g0 squared, I and S")
    J = Parameter(0.0, "s", "float inertia about O over H", min=0.0)
    dJ = Parameter(0.0, "s", "float inertia about S less that about I, over H")
    HK = Parameter(0.0, "s", "H over the stiffness that holds the float; 0: held by an integrating loop", min=0.0)
    J_IO = Parameter(0.0, "s", "product of inertia I O over H")
    J_OS = Parameter(0.0, "s", "product of inertia O S over H")
    J_SI = Parameter(0.0, "s", "product of inertia S I over H")

    def static(self, f: Vector) -> Number:
        """Return the drift rate omega_d for the specific force along I, O, S."""
        linear = vector([self.D_I, self.D_O, self.D_S])
        square = vector([self.D_II, self.D_OO, self.D_SS, self.D_IO, self.D_OS, self.D_IS])
        return drift_polynomial(self.D_F, linear, square, PER_G * f)

    def dynamic(self, w: Vector, a: Vector) -> Number:
        """Return the error delta for rate and angular acceleration along I, O, S."""
        quadratic = (self.dJ - self.HK) * w[2] * w[0] + self.J_SI * (w[2] * w[2] - w[0] * w[0])
        products = self.J_IO * (a[0] + w[1] * w[2]) + self.J_OS * (a[2] - w[0] * w[1])
        return quadratic + products - self.J * a[1]
