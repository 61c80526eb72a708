from gyrobench.component.blocks.place import Place


class Site(Place):
    """Site of the test: specific force and Earth rate, local frame ENU.  [CONV-FRAMES; TR8350.2]

        f = (0, 0, g)                    specific force a - G of a body at rest: it points up
        omega = W (0, cos L, sin L)      Earth rate, along the pole

    g is the measured gravity or, where that is 0, WGS84 normal gravity at latitude L and height z,

        g0 = g_e (1 + k sin2 L) / sqrt(1 - e2 sin2 L)                             (Somigliana)
        g  = g0 (1 - 2 (1 + F + m - 2 F sin2 L) z / a + 3 (z / a)2)               (second order in z)

    Nothing changes with time.  Not modelled: deflection of the vertical, polar motion, length of day, Earth
    tides, ground motion (use ground_motion).
    """

    version = "1.0.0"
