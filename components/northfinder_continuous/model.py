from gyrobench.component.blocks.north import RotatingFinder


class NorthfinderContinuous(RotatingFinder):
    """Heading from the rate of a gyro on a head that turns about the vertical, by least squares.  [NORTH-CONT]

        w = C cos(angle) + B sin(angle) + b (+ r t + r2 t2 + r3 t3),   C = A cos psi,   B = A sin psi

        psi = atan2(B, C),   A = hypot(C, B),   var psi = N2 (B2 P_CC - 2 B C P_CB + C2 P_BB) / A^4

    over all samples while the gate is open; P: inverse of the normal matrix, N: density of the white noise.  The
    latitude is not needed; it checks A.  Whole turns or not: the constant is in the fit.

    Refused: latitude within 5 deg of a pole.  Ill-conditioned: less than about half a turn.
    Not modelled: tilt of the head (see northfinder_tilt), errors of the angle, coloured noise in sigma.
    Source: GSP ch. 5, eq. 5-52..5-56, corrected: sums of w sin and w cos, sign of B, atan2.
    """

    version = "1.1.0"
