"""Drift tests of one gyro by several methods, with one report."""

from gyrobench.system.suite import Suite
from gyrobench.system.system import Option

FLOATED = "tumble_single_axis tumble_two_axis fixed_position open_loop_drift servo_vertical_level servo_polar"
TWO_AXIS = "tumble_two_channel eight_position servo_two_axis"


class DriftTestSuite(Suite):
    """A chosen set of drift tests on one gyro; the same coefficient by every method that sees it, with normalized
    errors and a test whether the methods agree.

    [CROSS-MAP, TEST-CHOICE; Hu 1981, ch. 3]
    """

    title = "Drift tests of one gyro by several methods"
    spec = ("CROSS-MAP",)
    sets = {"floated": FLOATED, "two_axis": TWO_AXIS}
    options = {"tests": Option("floated", str, "names of tests; floated or two_axis: all of that gyro"), **Suite.about}
    shared = ("torquer.scale_factor", "latitude")
    method = (
        "Each test is reduced by itself; its estimates are mapped to the coefficients of the drift model [CROSS-MAP] "
        "and compared where two methods or more see the same quantity"
    )
    sources = (
        "CROSS-MAP, TEST-CHOICE; Hu 1981, ch. 3",
        "E_n: ISO 13528; consistency: B. L. Welch, Biometrika 38 (1951) 330; R. T. Birge, Phys. Rev. 40 (1932) 207; "
        "S. Holm, Scand. J. Stat. 6 (1979) 65",
    )
    conventions = (
        "Hu 1981 and model: D_F = −R, D_I = −U_z, D_S = U_x, D_IS = −(K_zz − K_xx), D_II = −K_zx, D_SS = K_xz, "
        "D_IO = −K_zy, D_OS = K_xy (torque sign to precession sign).",
        "Where |f| is 1 g in all attitudes D_OO cannot be told apart: D_F stands for D_F + γ² D_OO, D_II for D_II − "
        "D_OO, D_SS for D_SS − D_OO; of a gyro with two axes Dx_yy and Dy_xx alike.",
        "The torquer scale factor and the latitude are one error in all tests that name them among their sources; all "
        "other errors are taken as independent from test to test.",
    )
