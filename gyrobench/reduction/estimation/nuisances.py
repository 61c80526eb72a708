"""Candidates for the nuisance model of a drift test, which of them a plan shows, and the table of what became of them.

    candidates = [trend(t_start, t_end), Candidate.of("ε_IO", "input axis towards output axis", "arcsec", column)]
    found = fit(quantities, X, y, ..., candidates=candidates)          # gyrobench.reduction.estimation.linear_fit

A candidate whose columns the coefficients (and the candidates before it) make up themselves is not observable and is
named with what it is aliased with.  The others are weighed by the fit (nuisance_states); from a probability of 99 % on
they are reported with the coefficients, below it only the intervals hold them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gyrobench import units
from gyrobench.arrays import Array
from gyrobench.frames import G0
from gyrobench.reduction.estimation import nuisance_states
from gyrobench.reduction.estimation.noise_estimate import Evidence, NoiseEstimate
from gyrobench.reduction.estimation.nuisance_states import NuisanceBlock
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.result import Reason, Table
from gyrobench.units import DPH

SCATTERS = {  # kind of the constants -> meaning of their scatter
    "mount": "standard deviation of the {} from mount to mount",
    "turn_on": "standard deviation of the {} from turn-on to turn-on",
}
BOTH = ("pass", "fail")
FREEDOM = 10  # degrees of freedom that must be left beside all candidates
CONTRASTS = 2  # of a scatter's constants that the rest of the model leaves free
VISIBLE = 1e-3  # least share of a column's length at right angles to the others
TORQUER = 0.02  # the same of an effect of the torquer
ASYMMETRY, SCALE_FACTOR = 1e-3, 1e-2  # largest of a sound torquer; also what a scale factor may have been mistaken by
#: largest error of a set-up that is meant to be sound, by its unit: a small angle, a torquer
MISTAKEN = {"arcsec": units.factor("deg"), "%": 0.1}
FLAGRANT = 10.0  # white-noise uncertainties from which on an effect beyond its bound is weighed too
NUISANCES = "nuisances"  # id of the table
COLUMNS = ["candidate", "meaning", "estimate", "u", "unit", "probability", "in the model", "largest change", "of u"]


@dataclass(frozen=True)
class Candidate:
    """One possible effect: columns (n,) or (n, k) of the data per SI unit of it; see nuisance_states.Block."""

    name: str
    meaning: str
    unit: str  # printed
    scale: float  # of it in SI
    columns: Array
    scatter: bool = False
    visible: float = VISIBLE  # least share of its length at right angles to the coefficients
    bound: float = math.inf  # SI; an effect that a record determines less well than this is not weighed
    largest: float = math.inf  # SI; of an error of the set-up: beyond it, something else is mistaken
    kind: str = ""  # of a scatter, see SCATTERS

    @classmethod
    def of(
        cls, name: str, meaning: str, unit: str, columns: Array, visible: float = VISIBLE, bound: float = math.inf
    ) -> Candidate:
        largest = MISTAKEN.get(unit, math.inf)
        return cls(
            name, meaning, units.display(unit), units.factor(unit), columns, visible=visible, bound=bound,
            largest=largest,
        )  # fmt: skip

    @property
    def block(self) -> NuisanceBlock:
        return NuisanceBlock(self.name, np.reshape(self.columns, (len(self.columns), -1)), self.scatter)


@dataclass(frozen=True)
class Read:
    """What a test reads, in the words and the unit (of ``scale`` SI) of its report."""

    name: str
    unit: str
    scale: float


DRIFT = Read("drift", "°/h", DPH)
FORCE = Read("bias", "µg", 1e-6 * G0)


def misalignments(turned: Callable[[int], Array], visible: float = VISIBLE) -> list[Candidate]:
    """Input axis towards output and spin axis; turned: data by rad about the gyro's axis k (0 I, 1 O, 2 S)."""
    each = (("ε_IO", "output", turned(2)), ("ε_IS", "spin", -turned(1)))
    text = "misalignment of the input axis towards the"
    return [Candidate.of(name, f"{text} {to} axis", "arcsec", column, visible) for name, to, column in each]


def trend(t_start: Array, t_end: Array, of: Read = DRIFT) -> Candidate:
    """Drift that changes linearly in time; its column has no mean, so that the constant is that of the middle."""
    middle = (t_start + t_end) / 2.0
    hours = (middle - np.average(middle, weights=t_end - t_start)) / 3600.0
    return Candidate("trend", f"linear change of the {of.name} in time", f"{of.unit}/h", of.scale, hours)


def temperature(windows: Mapping[str, Array], of: Read = DRIFT) -> list[Candidate]:
    """One candidate of each column temperature... of a record: its mean over all (K) and, of two, their difference."""
    named = {n: np.asarray(v, dtype=float) for n, v in windows.items() if n.startswith("temperature")}
    values = list(named.values())
    if not values:
        return []
    mean = np.mean(values, axis=0)
    each = f"{of.unit}/K"
    found = [Candidate("temperature", f"{of.name} per kelvin", each, of.scale, mean - mean.mean())]
    if len(values) == 2:
        step = values[1] - values[0]
        between = " and ".join(named)
        meaning = f"{of.name} per kelvin between {between}"
        found.append(Candidate("gradient", meaning, each, of.scale, step - step.mean()))
    return found


def scatter(kind: str, groups: Sequence[object], channel: str = "", of: Read = DRIFT) -> Candidate:
    """Return constants that scatter from group to group: groups (n,) names each row's mount, or turn-on.

    channel: as of :func:`common`.
    """
    keys = list(dict.fromkeys(groups))
    columns = np.array([[g == k for k in keys] for g in groups], dtype=float)
    meaning = SCATTERS[kind].format(of.name)
    return Candidate(f"σ_{kind}{channel}", meaning, of.unit, of.scale, columns, scatter=True, kind=kind)


def common(windows: Mapping[str, Array], channel: str = "", of: Read = DRIFT) -> list[Candidate]:
    """The candidates of every test: what thermometers read (columns temperature...), a trend, and constants that
    differ from turn-on to turn-on (column turn_on, their numbers).

    A temperature that only ramps is a trend: what was measured comes first, and the trend is named as its alias.
    channel: appended to their names, where several channels are reported together.  of: what is read.
    """
    t0, t1 = (np.asarray(windows[n], dtype=float) for n in ("t_start", "t_end"))
    found = [*temperature(windows, of), trend(t0, t1, of)]
    if "turn_on" in windows:
        found.append(scatter("turn_on", np.round(windows["turn_on"]).tolist(), of=of))
    return [replace(c, name=c.name + channel) for c in found]


def torquer(rate: Array, axis: str = "") -> list[Candidate]:
    """Return what a torquer may do to a rebalance test: rate = k i (n,), as the model has it, rad/s.

    A torquer whose scale factor is k (1 + a) for positive and k (1 - a) for negative currents leaves a |k i| in the
    drift omega_IA - k i, one whose scale factor is k (1 + d) leaves d k i.  Of k i the fitted one is taken: the noise
    of the measured one is in the drift too.  A window in which the current changes its sign counts with its mean.
    Small currents determine them less well than torquers are sound; weighed all the same, they would only widen the
    intervals.  Then u_nonlinearity and u_scale_factor state them.
    axis: about which the torquer acts, where there are two.
    """
    end, which = (f",{axis}", f" about {axis}") if axis else ("", "")
    kinds = (
        (f"k_±{end}", f"asymmetry of the torquer{which}, (k₊ − k₋)/(k₊ + k₋)", np.abs(rate), ASYMMETRY),
        (f"δk{end}", f"relative error of the scale factor of the torquer{which}", rate, SCALE_FACTOR),
    )
    return [Candidate.of(name, text, "%", column, TORQUER, bound) for name, text, column, bound in kinds]


def fitted(rate: Array, X: Array, y: Array) -> Array:
    """Return k i = omega_IA - drift with the drift that least squares fit: rate (n,), regressors X, drift y, rad/s."""
    return np.asarray(rate - X @ np.linalg.lstsq(X, y, rcond=None)[0])


def mounts(phase: Array | NDArray[np.int_], faces: Mapping[int, Array]) -> list[int]:
    """Return the number of the mount of each row: phases one after the other on the same face are one mount."""
    order = list(dict.fromkeys(np.asarray(phase).astype(int).tolist()))
    number = {order[0]: 0}
    for before, p in pairwise(order):
        number[p] = number[before] + (not np.allclose(faces[before], faces[p]))
    return [number[p] for p in np.asarray(phase).astype(int).tolist()]


class InTheModel(str):
    """A sentence of the summary on an effect that joined the model."""


@dataclass(frozen=True)
class Hidden:
    """A candidate that this plan does not show, and why; aliases: names of those that all of it is."""

    candidate: Candidate
    reason: str
    aliases: tuple[str, ...] = ()


def observable(
    X: Array, names: Sequence[str], candidates: Iterable[Candidate], y: Array | None = None
) -> tuple[list[Candidate], list[Hidden]]:
    """Return the candidates that the data can tell from the coefficients ``names`` of X and from one another.

    y (n,): without it candidates with a bound are told from the design alone.
    """
    seen: list[Candidate] = []
    hidden: list[Hidden] = []
    model, known = X, list(names)
    groups: list[Candidate] = []
    # a scatter last, it takes what is left; the one with fewer groups first: the other may be within it
    for c in sorted(candidates, key=lambda c: (c.scatter, c.block.columns.shape[1] if c.scatter else 0)):
        columns = c.block.columns
        if not np.any(np.abs(columns).max(axis=0) > 0.0):
            continue  # it does not occur: no temperature but one
        unit = columns / np.where(np.linalg.norm(columns, axis=0) > 0.0, np.linalg.norm(columns, axis=0), 1.0)
        left = unit - model @ np.linalg.lstsq(model, unit, rcond=None)[0]
        contrasts = int(np.sum(np.linalg.svd(left, compute_uv=False) > c.visible))
        if X.shape[0] - model.shape[1] - columns.shape[1] < FREEDOM:
            hidden.append(Hidden(c, f"not tested: fewer than {FREEDOM} degrees of freedom would be left"))
        elif c.scatter and contrasts < CONTRASTS:
            text = "all of its constants" if not contrasts else f"all but {contrasts} of its contrasts"
            hidden.append(
                Hidden(c, f"not observable: {text} aliased with {', '.join(_partners(columns, model, known))}; repeat")
            )
        elif c.scatter and (same := next((g for g in groups if _own_contrasts(c, g, model) < CONTRASTS), None)):
            hidden.append(Hidden(c, f"not observable: its groups are those of {same.name}"))
        elif y is not None and (reason := _beyond_bound(c, model, y)):
            hidden.append(Hidden(c, reason))
        elif not c.scatter and contrasts < columns.shape[1]:
            aliases = tuple(_partners(columns, model, known))
            hidden.append(Hidden(c, f"not observable: aliased with {', '.join(aliases)}", aliases))
        else:
            seen.append(c)
            if c.scatter:
                groups.append(c)
            else:
                model = np.column_stack([model, columns])
                known += [c.name] * columns.shape[1]
    return seen, hidden


def _beyond_bound(c: Candidate, model: Array, y: Array) -> str:
    """Return why an effect with a bound is not weighed: by least squares its uncertainty is larger; "" where it is."""
    if math.isinf(c.bound):
        return ""
    X = np.column_stack([model, c.block.columns])
    found, _, rank, _ = np.linalg.lstsq(X, y, rcond=None)
    if rank < X.shape[1]:
        return ""  # aliased: said elsewhere
    sigma = float(np.linalg.norm(y - X @ found)) / math.sqrt(X.shape[0] - X.shape[1])
    u = sigma * math.sqrt(float(np.linalg.inv(X.T @ X)[-1, -1]))
    if u <= c.bound or abs(found[-1]) > FLAGRANT * u:
        return ""
    size = plain(u / c.scale)
    return f"not weighed: this record determines it to {size} {c.unit} only, more than {c.bound / c.scale:g}"


def _own_contrasts(c: Candidate, other: Candidate, model: Array) -> int:
    """Return how many contrasts of a scatter are neither the model's nor those of another scatter."""
    known, columns = np.column_stack([model, other.block.columns]), c.block.columns
    unit = columns / np.linalg.norm(columns, axis=0)
    left = unit - known @ np.linalg.lstsq(known, unit, rcond=None)[0]
    return int(np.sum(np.linalg.svd(left, compute_uv=False) > c.visible))


def _partners(columns: Array, model: Array, names: Sequence[str]) -> list[str]:
    """Names of the columns of the model that make up ``columns``."""
    scale = np.linalg.norm(model, axis=0)
    share = np.abs(np.linalg.lstsq(model / scale, columns, rcond=None)[0]).max(axis=1)
    return list(dict.fromkeys(n for n, v in zip(names, share, strict=True) if v > 0.05 * share.max()))


def table(
    candidates: Sequence[Candidate], hidden: Sequence[Hidden], est: NoiseEstimate, names: Sequence[str]
) -> list[Table]:
    """Return the candidates with their estimates (if present), probabilities and what they change most."""
    rows: list[list[object]] = []
    for c, e in zip(candidates, est.evidence, strict=True):
        change = e.change / e.u_without
        j = int(np.argmax(np.abs(change)))
        value, u = (e.scatter[0], e.scatter[1]) if c.scatter else (float(e.value[0]), float(e.u[0]))
        joined = "yes" if e.joined else "no; the intervals allow for it"
        rows.append(
            [c.name, c.meaning, value / c.scale, u / c.scale, c.unit, e.probability, joined, names[j], float(change[j])]
        )
    for h in hidden:
        rows.append([h.candidate.name, h.candidate.meaning, None, None, h.candidate.unit, None, h.reason, "", None])
    if not rows:
        return []
    caption = (
        "Set-up effects weighed by the data, each with even odds beforehand. Estimate and u: if it is present. Largest "
        "change: coefficient that moves most when the effect is in the model, in its u without the effect. Estimates "
        "and intervals are means over all combinations, weighted by their probabilities, in which the odds of a single "
        f"effect count {nuisance_states.FAVOUR:g} times, so that effects of every size are covered alike."
    )
    return [Table(NUISANCES, "Nuisance model", caption, COLUMNS, rows)]


def sentences(
    candidates: Sequence[Candidate], est: NoiseEstimate, stated: Mapping[str, tuple[float, float]]
) -> list[str]:
    """Return what joined the model, as sentences; stated: name -> value and u (SI) of those that are coefficients."""
    out: list[str] = []
    for c, e in zip(candidates, est.evidence, strict=True):
        if not e.joined:
            continue
        of_columns = float(e.value[0]), float(e.u[0])
        value, u = (e.scatter[0], e.scatter[1]) if c.scatter else stated.get(c.name, of_columns)
        text = (
            f"In the model: {c.meaning}, {c.name} = {plain(value / c.scale, 3)} {c.unit} (u = {plain(u / c.scale)} "
            f"{c.unit}, probability {_percent(e.probability)})."
        )
        out.append(InTheModel(text))
    return out


def implausible(candidates: Sequence[Candidate], est: NoiseEstimate) -> list[Reason]:
    """Return which effects that joined are larger than an error of the set-up can be."""
    out = []
    for c, e in reported(candidates, est):
        if not c.scatter and abs(float(e.value[0])) > c.largest:
            size, most = float(e.value[0]) / c.scale, c.largest / c.scale
            text = (
                f"The fit takes the residuals for {c.name} = {plain(size, 3)} {c.unit} ({c.meaning}), more than "
                f"{most:g} {c.unit}: no error of the set-up, but an attitude, a sign, a column or a unit is mistaken."
            )
            out.append(Reason("nuisance.implausible", text, BOTH, severity="doubt"))
    return out


def _percent(p: float) -> str:
    return "above 99.9 %" if p > 0.999 else f"{plain(100.0 * p, 3)} %"


def reported(candidates: Sequence[Candidate], est: NoiseEstimate) -> list[tuple[Candidate, Evidence]]:
    """Return those that joined."""
    return [(c, e) for c, e in zip(candidates, est.evidence, strict=True) if e.joined]
