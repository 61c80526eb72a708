"""Errors of table, site and clock that the residuals show, in all six instruments together, and how large they are.

They go through all of them: an axis out of the right angle, which two accelerometers show, moves elements of the gyros'
matrix by as much, of which no residual says anything; a latitude that is 0.1° off is in each gyro's residuals below
what any test of one of them sees.  So each error has one size for all, and the precisions of all fits add up.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from gyrobench.reduction.estimation import asked
from gyrobench.reduction.estimation.nuisances import BOTH
from gyrobench.reduction.toolkit import Array, Findings, Reason, Source, plain
from gyrobench.units import ARCSEC

from .budget import ImuSetup

SEEN = 1e-5  # of what an error does to an instrument, least share that its fit leaves
MOST = 3  # errors at a time
LARGE = 0.1  # rad, or relative: no error of a set-up
CLEAR = 5.0  # u of each: smaller ones may make any residual ordinary
ALIKE = 9.0  # reduction of the squares, over u², by which another error that explains the residuals falls behind
Error = tuple[Source, float, float]  # size and u
Left = tuple[Array, Array, Array, Array, int]  # of one instrument: Findings.beside and degrees of freedom


def reasons(each: Mapping[str, Any], setup: ImuSetup, channel: Callable[[ImuSetup, str], Any]) -> list[Reason]:
    """Return the errors that the residuals show; none where there are none, or where these with their sizes do not
    make all instruments ordinary.

    each: name -> the fit of an instrument (ImuChannel).  channel: setup, name -> another one.
    """
    if not asked.whole() or setup.corrections or any(test.found.ideal or test.found.white for test in each.values()):
        return []
    errors = [[(s, e) for s, e in test.errors(test.found) if e.ndim == 1] for test in each.values()]
    sources = {source.id: source for source, _ in errors[0]}
    names = list(sources)
    left = [
        _left(test.found, np.column_stack([e for _, e in of])) for test, of in zip(each.values(), errors, strict=True)
    ]
    chosen: list[int] = []
    while len(chosen) < MOST:
        others = [k for k in range(len(names)) if k not in chosen]
        chosen.append(max(others, key=lambda k: _sizes([*chosen, k], left)[2]))
        sizes, u, _ = _sizes(chosen, left)
        if np.any((np.abs(sizes) < CLEAR * u) | (np.abs(sizes) > LARGE)):
            return []
        taken = [(names[k], float(s), float(v)) for k, s, v in zip(chosen, sizes, u, strict=True)]
        parts = [f"{n} = {s:.9g}({v:.3g}) {sources[n].unit}" for n, s, v in taken]
        corrected = replace(setup, corrections="; ".join(parts))
        with asked.residuals_alone():
            fits = [channel(corrected, n) for n in each]
            for fit in fits:
                fit.result()
        if not any(fit.found.broken() for fit in fits):
            best = _sizes(chosen, left)[2]
            alone = [(sources[names[k]], _sizes([k], left)) for k in others if k not in chosen]
            near = [(x, float(s[0]), float(v[0])) for x, (s, v, gain) in alone if gain > best - ALIKE]
            alike = [e for e in near if abs(e[1]) < LARGE]
            found = [(sources[n], s, v) for n, s, v in taken]
            return [Reason("table.off", _sentence(found, alike), BOTH, severity="error")]
    return []


def _sentence(taken: list[Error], alike: list[Error]) -> str:
    said = " and ".join(_words(*e) for e in taken) + "".join(f", or as well with: {_words(*e)}" for e in alike)
    given = "' or '".join("; ".join(_correction(*e) for e in way) for way in (taken, *([e] for e in alike)))
    return (
        f"The residuals contradict table and site as they are stated, and do not with: {said}. It is in the estimates, "
        "also of instruments whose residuals do not show it. Look for the cause; what is measured, or found here, is "
        f"taken out by corrections = '{given}'."
    )


def _words(source: Source, size: float, u: float) -> str:
    unit, (s, v) = "″" if source.unit == "rad" else "", _scaled(source, size, u)
    return f"{source.name}, {plain(s, 4)}{unit} (u = {plain(v)}{unit})".replace("-", "−")


def _correction(source: Source, size: float, u: float) -> str:
    s, v = _scaled(source, size, u)
    return f"{source.id} = {s:.4g}({v:.2g}) {'arcsec' if source.unit == 'rad' else '1'}"


def _scaled(source: Source, *values: float) -> list[float]:
    return [v / (ARCSEC if source.unit == "rad" else 1.0) for v in values]


def _left(found: Findings, columns: Array) -> Left:
    """Return what a fit leaves of each error (n, k); nothing of those that it holds."""
    basis = np.linalg.qr(found.est.X)[0]
    out = np.linalg.norm(columns - basis @ (basis.T @ columns), axis=0)
    seen = out > SEEN * np.linalg.norm(columns, axis=0)
    return *found.beside(np.where(seen, columns, 0.0)), found.y.size - basis.shape[1]


def _sizes(chosen: list[int], left: list[Left]) -> tuple[Array, Array, float]:
    """Return sizes and standard uncertainties of errors at once, and how far they reduce the squares, over u²."""
    precision, pull = np.zeros((len(chosen), len(chosen))), np.zeros(len(chosen))
    for square, own, squares, probability, dof in left:
        S, r = square[:, chosen][:, :, chosen], own[:, chosen]
        alone = np.einsum("gkl,gl->gk", np.linalg.pinv(S, hermitian=True), r)
        variance = np.maximum(squares - np.einsum("gk,gk->g", alone, r), 1e-300) / max(dof - len(chosen), 1)
        precision += np.einsum("g,gkl->kl", probability / variance, S)
        pull += np.einsum("g,gk->k", probability / variance, r)
    covariance = np.linalg.pinv(precision, hermitian=True)
    sizes = covariance @ pull
    return sizes, np.sqrt(np.diag(covariance)), float(sizes @ pull)
