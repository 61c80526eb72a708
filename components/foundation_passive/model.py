from gyrobench.component.blocks.foundation import Foundation


class FoundationPassive(Foundation):
    """Foundation of a table on springs and dampers alone: it takes what is faster than its mount.  [ENV-FOUNDATION]

        T = (2 d w s + w2)/(s2 + 2 d w s + w2)     block over ground, along an axis and in tilt

    below 1 from sqrt(2) times the natural frequency on: 3.5 Hz takes away what is above 5 Hz.  Slow tilts pass.

    Fits the slot of a foundation.  Equations, ports and limits: block Foundation.
    Source: Hu 1981, section 5.6 (three-2).
    """

    version = "1.0.0"
