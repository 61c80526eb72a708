"""Record of a stabilized gimbal -> margins, isolation, jitter of the line of sight with its budget by source."""

from __future__ import annotations

from gyrobench.reduction.loops.loop_toolkit import Account, margins, told
from gyrobench.reduction.loops.sight_reduction import AXES, SightReduction


class Reduction(SightReduction):
    """Loads, loops and base motion of a gimbal of two axes, and the jitter of its line of sight."""

    ranked_by = "jitter"

    def measure(self) -> Account:
        self.loads_and_loops()
        self.isolation()
        ride = self.ride()
        self.cause = self.jitter(ride) if ride is not None else ""
        self.keyhole()
        return Account(
            method="Load steps, test sines of both loops, sines of the base and a ride on a vibrating base, line of "
            "sight of a gimbal of two axes",
            sources=["GIMBAL-2AXIS, LOS-JITTER, BASE-PSD; Masten 2008; Hilkert 2008; Welch 1967"],
            equation="S_(l o s) = sum_i abs(T_i (j omega))^2 S_i, quad "
            "sigma^2 = integral_(f_1)^oo S_(l o s) dif f, quad u_O = omega_(l o s) \\/ cos theta_I",
            conventions=[
                "The line of sight is y of the inner gimbal; pitch turns it about x, yaw about z, by the right hand.",
                "Jitter is the root mean square of its angle from the stated frequency on; slower motion is drift.",
                "L is the loop opened at the input of a stabilizer: what comes back over what is put in, with minus.",
            ],
        )

    def summary(self) -> list[str]:
        found = self.found
        return [
            *told(found.coefficients, f"The line of sight jitters by {{jitter}} rms{self.cause}."),
            *margins(found, *AXES),
            *told(found.coefficients, "A swing of the base about x and z reaches the line of sight smaller by "
                  "{-isolation x 1 Hz} and {-isolation z 1 Hz} at 1 Hz."),
        ]  # fmt: skip
