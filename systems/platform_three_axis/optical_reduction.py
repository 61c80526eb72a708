"""Record of the platform with its optical loop -> tracking error, lag, margins of rate and tracking loops."""

from __future__ import annotations

from gyrobench.reduction.loops.loop_toolkit import Account, margins, told
from gyrobench.reduction.loops.tracking_measures import SIGHT, TrackingMeasures

AXES = ("pitch", "roll", "azimuth")
HELD = {f"estimator_{axis}": 0.0 for axis in "xyz"}  # where they are fitted


class OpticalReduction(TrackingMeasures):
    """Loops of a line of sight on a platform of three gimbals, and its error while the target moves."""

    ranked_by = "error"

    @property
    def track(self) -> float:
        return float(self.run.options["track"] or self.run.options["crossover"] / 8.0)

    def measure(self) -> Account:
        found = self.found
        for k, axis in enumerate(AXES, 1):
            found.open_loop(axis, f"{axis}.e", f"exciter.test[{k}]", k, held=HELD)
        self.loops()
        ride = self.ride()
        if ride is not None:
            self.error(ride)
            self.lost()
        return Account(
            method="Test sines of rate and tracking loops, ride in which the target moves, platform of three gimbals",
            sources=[
                "TRACK-LOOP, TRACK-IMAGE, LOS-TARGET, SERVO-3LOOP, PLATFORM-3AXIS-DYN, DECOUPLE-T2; Xia 2008, section "
                "1.3.2, fig. 1.3; Masten 2008; Franklin 2010"
            ],
            equation="e = c_1 omega_t + c_2 dot(omega)_t, quad 1/(1 + L) = c_1 s + c_2 s^2 + ..., quad u_A = T_2 u",
            conventions=[
                "The line of sight is y of the inner element; the tracking error is the true direction of the target "
                "less that of it, about x (pitch) and z (yaw).",
                "Its lag is what the linear model makes of the target's rate and acceleration; bias is its mean.",
                "L is the loop opened at the input of a controller: what comes back over what is put in, with minus.",
            ],
        )

    def summary(self) -> list[str]:
        found = self.found
        return [
            *told(found.coefficients, "The tracking error is {error} rms, both axes, {peak} at most."),
            *told(found.coefficients, "Its mean is {bias pitch} about pitch and {bias yaw} about yaw."),
            *margins(found, *AXES, *(f"track {a}" for a in SIGHT)),
        ]
