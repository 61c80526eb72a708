from __future__ import annotations

from gyrobench.component import Input, Parameter
from gyrobench.component.blocks.rebalance import AnalogRebalance
from gyrobench.component.math import Number


class RebalanceTwoAxis(AnalogRebalance):
    """One channel of the two-axis torque rebalance of a tuned or free rotor gyro, with a cross term.  [REBAL-TWO-AXIS]

        i = K_p u + K_i q + K_q u_cross limited to +-i_max,   q' = u
        q' = 0 while the limit is reached and u pushes further (conditional integration: no wind-up)
        i_read = i_flowed + noise, rounded to the resolution

    u is the pickoff that this channel nulls, u_cross the other one.  A free or tuned rotor whose angles are alpha
    about x and beta about y has two such channels, i_x nulling u_y and i_y nulling u_x (u = -K_sg times the angle,
    torquers k).  With the cross gain K_q in that of i_x and -K_q in that of i_y

        alpha' = k_q beta - k_phi alpha                 k_phi = k K_sg K_p
        beta' = -k_q alpha - k_phi beta                 k_q = k K_sg K_q

    without integrals: the rotor comes to its null in a spiral, exp(-(k_phi + j k_q) t) of alpha + j beta.  The same
    term is made by a rate w_z of the case about the spin axis, alpha' = w_z beta, beta' = -w_z alpha, and by the
    spring that a tuned suspension leaves; K_q takes it out.  In the steady state u and u_cross are null, so that the
    readings do not depend on K_q.

    Not modelled: as rebalance_analog; spring and damping of a tuned suspension (in the gyro's part, if it has them).
    Source: derived; Hu 1981, section 5.5.  Its eq. 5-68, of the same form, is the drift that the springs of a flexure
    or gas-bearing gyro make of an angle that the loop leaves.
    """

    version = "1.0.0"

    K_q = Parameter(0.0, "A/V", "cross gain: current per voltage of the other pickoff")

    u_cross = Input(0.0, "V", "pickoff voltage of the other channel")

    def demand(self) -> Number:
        return self.K_p * self.u + self.K_i * self.q + self.K_q * self.u_cross
