from gyrobench.component.blocks.rebalance import AnalogRebalance


class RebalanceAnalog(AnalogRebalance):
    """Analogue torque rebalance of a floated gyro: PI with current limit.  [LOOP-REBALANCE, REBAL-ANALOG]

        i = K_p u + K_i q limited to +-i_max,   q' = u
        q' = 0 while the limit is reached and u pushes further (conditional integration: no wind-up)
        i_read = i_flowed + noise, rounded to the resolution

    i is what flows from now on, i_flowed what flowed during the step that ends now: that is what an integrating
    meter reads, and what balanced the gyro up to now.  Read so, the exchange of u and i once a step does not
    shift the reading against the table angle (read as i it is one step early).  One internal step is one
    communication step (`step` is large for that reason); q is exact for a held u.

    The pickoff gives u = K_sg b and the torquer gives -H k i on the float, so the loop of LOOP-REBALANCE,
    M = -20 b - 200 (integral of b) in N.m, is K_p = 20 / (K_sg H k), K_i = 200 / (K_sg H k).  With
    K_sg = 10 V/rad, H = 0.2 N.m.s and k = 17.2 deg/h/mA = 0.083387953 rad/s/A, K_sg H k = 0.16677591 and
    K_p = 119.921 A/V, K_i = 1199.21 A/(V.s).  Closed with J = 2e-4 kg.m2, C = 0.2 N.m.s the poles are -11.25,
    -100 and -888.7 1/s.  The loop has two integrations (float and q): in the steady state u = 0 and
    k i = omega_IA - omega_d exactly.

    Not modelled: bandwidth and drift of the current source, heating of the torquer, pulse-width operation.
    Source: Hu 1981, ch. 5, eq. 5-62..5-67.
    """

    version = "1.0.0"
