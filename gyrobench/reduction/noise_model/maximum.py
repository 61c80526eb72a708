"""Maximum of the posterior of a noise model, and the volume of the posterior about it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.noise_model.ordinates import Model, Ordinates, split
from gyrobench.reduction.noise_model.prior import Prior
from gyrobench.reduction.noise_model.sensor_filters import MEANS
from gyrobench.reduction.noise_model.terms import PEAKS

NEARLY_WHOLE = 0.02  # of the width of an average: a mean over a whole number of samples is tried in its place
STEPS = 40  # of the search for a maximum
PRICE = 2.5  # of a parameter of a filter, of the logarithm of the evidence
FLAT = 1e-2  # information of a parameter below which the search leaves it where it is
WIDEST = 0.25  # information of a parameter that the record does not tell: its volume is the prior's, some 5


@dataclass(frozen=True)
class Fitted:
    """Maximum of the posterior of a model: parameters p (q,), information (q, q), -2 log likelihood, log evidence."""

    model: Model
    p: Array
    information: Array
    value: float
    evidence: float


def maximize(data: Ordinates, prior: Prior, model: Model, start: Array) -> Fitted:
    """Return the maximum of the posterior near ``start`` (q,), by scoring steps."""
    low, high = prior.bounds(model)
    p, h, q = np.clip(start, low, high), 1e-3, start.size
    signs = np.concatenate([np.zeros((1, q)), h * np.eye(q), -h * np.eye(q)])

    def at(p: Array) -> tuple[float, Array, Array]:
        """Return -2 log posterior, its gradient and curvature."""
        value, gradient, info = data.scoring(model, p)
        v = -2.0 * prior.log(model, p + signs)
        up, down = v[1 : 1 + q], v[1 + q :]
        curve = np.maximum((up + down - 2.0 * v[0]) / h**2, 0.0)
        return value + float(v[0]), gradient + (up - down) / (2.0 * h), info + np.diag(curve)

    f, g, H = at(p)
    damp = 1e-4
    for _ in range(STEPS):
        # what the record does not tell of a parameter is rounding: it must not make the steps of the others small
        size = np.sqrt(np.diag(H) + FLAT)
        step = -np.linalg.solve((H + FLAT * np.eye(q)) / np.outer(size, size) + damp * np.eye(q), g / size) / size
        step *= min(1.0, 2.0 / max(float(np.max(np.abs(step))), 1e-12))
        trial = np.clip(p + step, low, high)
        gain = -float(g @ (trial - p))
        if gain < 1e-2:
            break
        f2, g2, H2 = at(trial)
        if np.isfinite(f2) and f2 < f:
            done = f - f2 < 3e-3
            p, f, g, H = trial, f2, g2, H2
            damp = max(0.1 * damp, 1e-7)
            if done:
                break
        else:
            damp = max(10.0 * damp, 1e-2)
            if damp > 1e6:
                break
    information = 0.5 * H
    evidence = -0.5 * f + volume(model, information) - by_chance(model, p, information)
    return Fitted(model, p, information, f + 2.0 * float(prior.log(model, p[None])[0]), evidence)


def volume(model: Model, information: Array) -> float:
    """Return the logarithm of the volume of the posterior over the parameters of the terms, those of a filter or a
    resonance given; each of these costs PRICE.

    Their prior is known to nobody: how sharply the record shows their parameters is no argument against them, nor is it
    one for them that they leave a term beside them open.
    """
    filters = np.concatenate([(np.arange(t.size) * (t.name == "white") > 0) | (t.name in PEAKS) for t in model])
    H = information[np.ix_(~filters, ~filters)] + WIDEST * np.eye(int(np.sum(~filters)))
    # the number of samples of a mean was sought as that of any mean
    priced = int(np.sum(filters)) + sum(t.filter.startswith(tuple(MEANS)) for t in model)
    return 0.5 * len(H) * math.log(2.0 * math.pi) - 0.5 * float(np.linalg.slogdet(H)[1]) - PRICE * priced


def by_chance(model: Model, p: Array, information: Array) -> float:
    """Return what the width of an average costs more than that of a mean over a whole number k of samples nearby.

    Of widths as likely in the cell of k, log (k + 1/2)/(k - 1/2) wide, one that the record shows to s lies as near to k
    by chance in sqrt(2 pi) s of it; sensors take means of whole numbers of samples on purpose.
    """
    out, at = 0.0, 0
    for term, q in split(model, p):
        if term.filter.startswith("average") and (k := nearly_whole(q[1])):
            cell = math.log((k + 0.5) / (k - 0.5))
            out += max(math.log(cell * math.sqrt((information[at + 1, at + 1] + WIDEST) / (2.0 * math.pi))), 0.0)
        at += term.size
    return out


def nearly_whole(log_width: float) -> int:
    """Return the whole number of samples, from two on, that the width of an average is nearly, 0 where it is none."""
    width = math.exp(log_width)
    whole = round(width)
    return whole if whole > 1 and abs(width / whole - 1.0) < NEARLY_WHOLE else 0
