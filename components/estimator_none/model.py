from __future__ import annotations

from gyrobench.component import Component, Input, Output


class EstimatorNone(Component):
    """No estimator: the reading itself, without delay.

        estimate = z,   latency = 0

    What every estimator has to beat, and what a loop has without one.

    Not modelled: nothing is; a reading that is marked as missing cannot be passed on, so there is no input for it.
    Source: the socket Estimator of BENCH-DYN-SINE (its comparison row "raw").
    """

    version = "1.0.0"

    z = Input(0.0, "1", "reading")

    estimate = Output("1", "estimate, unit of z")
    latency = Output("s", "delay of the estimate")

    def outputs(self) -> None:
        self.estimate = self.z
        self.latency = 0.0
