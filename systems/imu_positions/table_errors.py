"""Errors of the table that the accelerometers show: which ones make what they leave ordinary, and how large they are.

They go through all six instruments: an axis out of the right angle, which the residuals of two accelerometers show,
moves elements of the gyros' matrix by as much, of which no residual says anything.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.estimation import asked
from gyrobench.reduction.estimation.drift_test import DriftReduction
from gyrobench.reduction.estimation.nuisances import BOTH
from gyrobench.result import Reason
from gyrobench.units import ARCSEC

from .budget import ImuSetup, Kinematics
from .channels import AXES
from .geometry import accelerometer_columns

SEEN = 0.05  # of the change of the forces by an error, least share that bias and matrix leave
MOST = 3  # errors at a time
CLEAR = 5.0  # u of each: smaller ones may make any residual ordinary
Channel = Callable[[ImuSetup, str], DriftReduction[ImuSetup]]


def reasons(
    each: Mapping[str, DriftReduction[ImuSetup]], windows: Mapping[str, Array], at: Kinematics, channel: Channel
) -> list[Reason]:
    """Return the errors of the table that explain what contradicts the accelerometers' fits; none where nothing does,
    or no such errors do.  channel: setup, name -> the fit of an instrument.
    """
    names, setup = [f"a{a}" for a in AXES], at.setup
    if setup.thermal or setup.corrections or not any(each[n].found.broken() for n in names):
        return []
    shapes = _shapes(at)
    data = _left(at, np.column_stack([np.asarray(windows[f"mean_{n}"], dtype=float) for n in names]) - at.felt[1])
    chosen: list[str] = []
    for _ in range(min(MOST, len(shapes))):
        chosen.append(min(set(shapes) - set(chosen), key=lambda n: _fit([*chosen, n], shapes, data)[2]))
        sizes, u, _ = _fit(chosen, shapes, data)
        if np.any(np.abs(sizes) < CLEAR * u):
            break
        parts = [f"{n} = {s:.9g}({v:.3g}) rad" for n, s, v in zip(chosen, sizes, u, strict=True)]
        corrected = replace(setup, corrections="; ".join(parts))
        with asked.residuals_alone():
            fits = [channel(corrected, n) for n in names]
            for fit in fits:
                fit.result()
        if not any(fit.found.broken() for fit in fits):
            words = {source.id: source.name for source, _ in at.changes}
            each_one = [(n, s / ARCSEC, v / ARCSEC) for n, s, v in zip(chosen, sizes, u, strict=True)]
            said = " and ".join(f"{words[n]}, {s:.4g}″ (u = {v:.2g}″)" for n, s, v in each_one).replace("-", "−")
            given = "; ".join(f"{n} = {s:.4g}({v:.2g}) arcsec" for n, s, v in each_one)
            text = (
                f"The accelerometers contradict the table as it is stated, and do not with: {said}. It is in the "
                "estimates of the gyros, too. Look for the cause; what is measured, or found here, is taken out by "
                f"corrections = '{given}'."
            )
            return [Reason("table.off", text, BOTH, severity="error")]
    return []


def _left(at: Kinematics, values: Array) -> Array:
    """Return what bias and matrix of three accelerometers leave of values (n, 3) at rest, one behind the other."""
    rest = at.motion.at_rest
    X = accelerometer_columns(at.felt[1][rest])
    return np.asarray((values[rest] - X @ np.linalg.lstsq(X, values[rest], rcond=None)[0]).T.ravel())


def _shapes(at: Kinematics) -> dict[str, Array]:
    """Return what each error of one radian leaves, of those that are seen."""
    found = {}
    for source, (_, change) in at.changes:
        if change.ndim == 2 and source.unit == "rad" and np.any(change):
            left = _left(at, change)
            if np.linalg.norm(left) > SEEN * np.linalg.norm(change[at.motion.at_rest]):
                found[source.id] = left
    return found


def _fit(names: list[str], shapes: Mapping[str, Array], data: Array) -> tuple[Array, Array, float]:
    """Return sizes and standard uncertainties of errors, and the squares that they leave."""
    X = np.column_stack([shapes[n] for n in names])
    sizes = np.linalg.lstsq(X, data, rcond=None)[0]
    squares = float(np.sum((data - X @ sizes) ** 2))
    freedom = max(data.size - 12 - len(names), 1)  # three instruments of four unknowns
    u = np.sqrt(np.diag(np.linalg.pinv(X.T @ X)) * squares / freedom)
    return np.asarray(sizes), np.asarray(u), squares
