"""Record of a tracking gimbal -> tracking error with its lag, jitter by source, margins of all loops."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.record.run_document import LinearModel
from gyrobench.reduction.loops.jitter import Complex, segments
from gyrobench.reduction.loops.loop_toolkit import Account, margins, told
from gyrobench.reduction.loops.margins import excitation_responses
from gyrobench.reduction.loops.sight_budget import EXCITED, LOS, MoreSources, Ride, closed_model
from gyrobench.reduction.loops.sight_reduction import AXES, SightReduction
from gyrobench.reduction.loops.tracking_measures import MISS, RATE, TrackingMeasures
from gyrobench.result import SetBy

from .sources import TARGET, image_density, image_noises, prediction, set_by

PAIR = (0, 1)


class Reduction(TrackingMeasures, SightReduction):
    """Tracking error, lag and jitter of a line of sight that follows a target; its loops."""

    ranked_by = "error"
    sight = MISS
    what = "tracking error"

    def measure(self) -> Account:
        self.loads_and_loops()
        self.loops()
        self.isolation()
        self.cause, ride = "", self.ride()
        self.gate = ride  # for the sources of the budget
        if ride is not None:
            self.error(ride)
            self.cause = self.jitter(ride)
            self.lost()
        self.keyhole()
        return Account(
            method="Load steps, test sines of rate and tracking loops, steps of the wanted direction, sines of the "
            "base and a ride in which the target moves and the base vibrates",
            sources=["TRACK-LOOP, TRACK-IMAGE, LOS-TARGET, GIMBAL-2AXIS, LOS-JITTER, BASE-PSD; Masten 2008; "
                     "Hilkert 2008; Franklin 2010; Welch 1967"],
            equation="e = c_1 omega_t + c_2 dot(omega)_t, quad 1/(1 + L) = c_1 s + c_2 s^2 + ..., quad "
            "S_e = sum_i abs(T_i (j omega))^2 S_i",
            conventions=[
                "The tracking error is the true direction of the target less that of the line of sight, about x (pitch)"
                " and z (yaw) of the inner gimbal.",
                "Its lag is what the linear model makes of the target's rate and acceleration; bias is its mean.",
                "Jitter is the root mean square of the error from the stated frequency on.",
                "L is the loop opened at the input of a controller: what comes back over what is put in, with minus.",
            ],
        )  # fmt: skip

    def summary(self) -> list[str]:
        found = self.found
        return [
            *told(found.coefficients, "The tracking error is {error} rms, both axes, {peak} at most."),
            *self.inside(),
            *told(found.coefficients, "Its mean is {bias pitch} about pitch and {bias yaw} about yaw."),
            *told(found.coefficients, f"From the stated frequency on it is {{jitter}} rms{self.cause}."),
            *margins(found, *AXES, *(f"track {a}" for a in AXES)),
        ]  # fmt: skip

    def more_sources(self, ride: Ride, use: NDArray[np.bool_]) -> MoreSources | None:
        """Return the motion of the target and the noise of the images."""
        model = closed_model(self.found)
        f = ride.los[0].f[use]
        inside = self._ways(model, [f"track_{axis}.e" for axis in AXES], f)
        sight = self._ways(model, LOS, f)
        lowest = float(self.run.options["jitter_from"])
        assert self.gate is not None
        dt = float(self.gate.t[1] - self.gate.t[0])
        moved = np.zeros((), complex)
        for k in PAIR:
            rate = segments(dt, self.gate[RATE[k]], lowest)
            assert rate is not None
            way = inside[:, :, k] / (2j * np.pi * f[:, None])
            moved = moved - way.T[:, None, :] * rate[None, :, use]  # of the line of sight: the error with minus
        return MoreSources({TARGET: moved}, self._images(sight, f))

    @staticmethod
    def _ways(model: LinearModel, names: Sequence[str], f: Array) -> Complex:
        """Return (frequency, name, axis) of the responses to what is added to the error of the image."""
        return excitation_responses(model, "command", EXCITED, names, f)

    def set_by(self, source: str, p: Mapping[str, Any]) -> list[SetBy]:
        return set_by(source, p)

    def _images(self, sight: Complex, f: Array) -> dict[str, Array]:
        """Return the densities by noise and resolution of the images, held from frame to frame."""
        p = self.run.parameters
        period, noise, pixel = (float(p.get(f"tracker.{n}", 0.0)) for n in ("period", "image_noise", "pixel"))
        shape = np.sum(np.abs(sight) ** 2, axis=2).T * np.abs(prediction(p, f)) ** 2
        found = {name: shape * image_density(period, s)(f) for name, s in image_noises(noise, pixel).items()}
        return {name: y for name, y in found.items() if np.any(y)}
