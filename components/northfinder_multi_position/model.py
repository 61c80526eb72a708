from gyrobench.component.blocks.north import RotatingFinder


class NorthfinderMultiPosition(RotatingFinder):
    """Heading from the mean rates of a gyro in three or more positions of a head, by least squares.  [NORTH-CONT]

        w_i = C cos(angle_i) + B sin(angle_i) + b (+ r t + r2 t2 + r3 t3)
        C = A cos psi,   B = A sin psi,   psi = atan2(B, C)

    The positions need not be equally spaced nor equally long: each sample counts with its own angle and time.

    Refused: latitude within 5 deg of a pole.  Ill-conditioned: fewer than three positions, or all within half a turn.
    Not modelled: tilt of the head (see northfinder_tilt), errors of the angle, coloured noise in sigma.
    Source: GSP ch. 5, eq. 5-44, 5-52..5-56, corrected.
    """

    version = "1.1.0"
