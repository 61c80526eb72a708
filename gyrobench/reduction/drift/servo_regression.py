"""Tests in which the gyro holds the table, torquer idle: the table rate tells the drift.  [MEAS-SERVO; eq. 3-59]

    theta' + omega_E,x = omega_d = -omega_M         theta right-handed about the input axis x, which is the table axis

omega_d is the drift of gyrobench.drift in precession sign, omega_M that of Hu 1981 in torque sign (BOOK maps one to the
other, CROSS-MAP).  A window says what the table turned from its first to its last reading, so the data are exact means,
and neighbours share a reading.  Regressors are averaged over the window as the data are, along a curve in time through
the readings: the rate of a gyro with a large unbalance changes within a window.

Not modelled: J/H times the angular acceleration of the case
about the output axis, which the gyro cannot tell from a rate: (J/H) theta' (c omega_E,z - s omega_E,y), with the Earth
rate along y and z at angle 0; 5e-7 deg/h at most, nothing with the table axis along the pole.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gyrobench import drift, frames
from gyrobench.arrays import Array
from gyrobench.attitudes import on_servo_table
from gyrobench.reduction.drift import channels, window_regressors
from gyrobench.reduction.estimation import nuisances
from gyrobench.reduction.estimation.effects import one_by_one
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.estimation.nuisances import Candidate
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.setup import sources, window_checks
from gyrobench.reduction.setup.run_metadata import Location
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import Table

REQUIRED = ("phase", "t_start", "t_end", "angle_start", "angle_end")
SMALL = 1e-5  # rad, step of the geometric perturbations
#: least share of a misalignment's effect that the coefficients must leave: what a little turning in dwells shows of it
#: would let degrees pass, and D_F and D_I with them
PART = 0.1
TRACKING = 2.0 / 3600.0 * np.pi / 180.0  # rad, limit of Hu 1981 for the table against the gyro

#: our name -> that of Hu 1981, and its sign against ours  [CROSS-MAP]; D_O is empirical, after eq. 2-40
BOOK: dict[str, tuple[str, int]] = {
    "D_F": ("R", -1), "D_I": ("U_z", -1), "D_O": ("U_y", -1), "D_S": ("U_x", 1), "D_II": ("K_zx", -1),
    "D_SS": ("K_xz", 1), "D_IO": ("K_zy", -1), "D_OS": ("K_xy", 1), "D_IS": ("ΔK", -1),
}  # fmt: skip


@dataclass(frozen=True)
class HeldWindows:
    """Windows of a held table: angles (n,) rad, times (n,) s, and the gyro axes x, y, z (rows, in ENU) at angle 0 of
    each window (n, 3, 3).  body: the gyro axes in those of the attitude, for mounts that are not true.  torqued (n,):
    precession by the torquer, rad/s.
    """

    angle_start: Array
    angle_end: Array
    t_start: Array
    t_end: Array
    axes: Array
    body: Array | None = None
    torqued: Array | None = None

    @property
    def rate(self) -> Array:
        """Return the mean table rate of each window (n,), rad/s."""
        return np.asarray((self.angle_end - self.angle_start) / (self.t_end - self.t_start))

    @functools.cached_property
    def nodes(self) -> Array:
        """Angles (n, 12) at which the windows are averaged."""
        return window_regressors.held_nodes(self.angle_start, self.angle_end, self.t_start, self.t_end)

    def turned(self, **axes_or_body: Array) -> HeldWindows:
        """Return the same windows on other axes or of another gyro."""
        other = replace(self, **axes_or_body)
        other.__dict__["nodes"] = self.nodes  # which a new one would find again from the same angles
        return other

    def seen(self, local: Array) -> Array:
        """Return a vector in ENU in gyro axes at the 12 nodes of each window: (n, 12, 3)."""
        v = self.axes @ local
        a = self.nodes
        c, s = np.cos(a), np.sin(a)
        x, y, z = (v[:, k, None] for k in range(3))
        out: Array = np.stack([np.broadcast_to(x, a.shape), c * y + s * z, c * z - s * y], axis=-1)
        return out if self.body is None else np.asarray(out @ self.body.T)


def held_windows(
    windows: Mapping[str, Array], labels: Mapping[int, str], known: Collection[str], latitude: float
) -> tuple[HeldWindows, NDArray[np.int_], NDArray[np.bool_]]:
    """Return the windows of the phases in ``labels`` (phase -> attitude), their phase numbers, and their rows.

    Raises ReductionError for an attitude that is not one of ``known``, and for windows that cannot be read.
    """
    there = "; ".join(known)
    wrong = [f"phase {p}: attitude '{n}' unknown; there are {there}" for p, n in labels.items() if n not in known]
    if wrong := wrong or window_problems(windows, labels):
        raise ReductionError(wrong)
    every = np.asarray(windows["phase"]).astype(int)
    rows = np.isin(every, list(labels))
    phase = every[rows]
    of_phase = {p: on_servo_table(name, latitude) for p, name in labels.items()}
    axes = np.array([of_phase[p] for p in phase.tolist()])
    columns = (np.asarray(windows[c], dtype=float)[rows] for c in ("angle_start", "angle_end", "t_start", "t_end"))
    start, end, t0, t1 = columns
    return HeldWindows(start, end, t0, t1, axes), phase, rows


def drift_rate(held: HeldWindows, site: Location) -> Array:
    """Return the data (n,): inertial rate along the input axis, which is the drift omega_d, rad/s."""
    earth = window_regressors.average(held.seen(site.earth_rate * frames.pole(site.latitude))[:, :, 0])
    along = 1.0 if held.body is None else held.body[0, 0]
    out: Array = earth + along * held.rate
    return out if held.torqued is None else out - held.torqued


def design(held: HeldWindows, site: Location, names: tuple[str, ...]) -> Array:
    """Return the window means (n, p) of the drift regressors ``names``."""
    return window_regressors.average(drift.regressors(held.seen(np.array([0.0, 0.0, -site.g])), names))


def window_problems(
    windows: Mapping[str, Array], labels: Mapping[int, str], required: Sequence[str] = REQUIRED
) -> list[str]:
    """Return what is wrong with the rows of the phases in ``labels`` (phase -> attitude), as sentences."""
    for c in [c for c in windows if c.startswith("flagged")]:  # what happened while the table was moved does not matter
        windows = {**windows, c: np.where(np.isin(windows["phase"], list(labels)), windows[c], 0)}
    problems = window_checks.window_problems(windows, required)
    if problems:
        return problems
    present = set(np.asarray(windows["phase"]).astype(int).tolist())
    missing = [f"phase {p} ({label}) has no windows" for p, label in labels.items() if p not in present]
    return missing or ([] if labels else ["the record holds no phase in which the gyro holds the table"])


def tracking_problems(windows: Mapping[str, Array], rows: NDArray[np.bool_], gain: float, limit: float) -> list[str]:
    """Return where the table did not follow the gyro to ``limit`` (rad), as a sentence.

    From the pickoff voltage (columns mean and std) and the gain of the gyro, as far as both are known.
    """
    if not gain or "mean" not in windows or not limit > 0.0:
        return []
    size = (np.abs(windows["mean"]) + np.nan_to_num(windows["std"])) / gain
    exceeding = np.flatnonzero(rows & (size > limit))
    if not exceeding.size:
        return []
    arcsec = np.degrees(float(np.max(size[exceeding]))) * 3600.0
    return [
        f"the table is up to {plain(arcsec, 3)} arcsec away from the gyro in {exceeding.size} windows (first: row "
        f"{exceeding[0] + 1}); "
        f"{plain(np.degrees(limit) * 3600.0, 3)} arcsec are allowed: friction or torque ripple too large for the loop"
    ]


def effects(
    held: HeldWindows, site: Location, fit: Findings, columns: Callable[[HeldWindows], Array], phase: NDArray[np.int_],
    sizes: Any,
) -> list[sources.Effect]:  # fmt: skip
    """Return the effects of type B of the set-up of a held table.

    Axis of the table and its wobble, mount of the gyro on it, angle errors of order 1 and 2, time base.  sizes: u_axis,
    u_mount, u_wobble, u_angle1, u_angle2 (rad), u_unbalance (rad at 1 g), u_time (relative).  The axis is set up anew
    in each phase: the phases are independent errors; so are sine and cosine of the angle errors.
    columns: what is fitted.
    """
    y, X = drift_rate(held, site), columns(held)

    def moved(other: HeldWindows) -> Array:
        return fit.error(drift_rate(other, site) - y, columns(other) - X) / SMALL

    def axis(k: int) -> Array:
        return one_by_one(moved(held.turned(axes=frames.rotation(np.eye(3)[k], SMALL) @ held.axes)), phase)

    def wobble() -> Array:  # q about y, z is (cos, sin) of 2 theta + phase, as of the part axis_wobble
        middle = held.angle_start + held.angle_end
        cases = []
        for a in (middle, middle + np.pi / 2.0):
            q = np.column_stack([np.zeros_like(a), np.cos(a), np.sin(a)])
            # the reduction takes the axis as still: against the axis as it is, it is turned by -q
            turned = held.axes + SMALL * np.cross(q[:, None, :], np.swapaxes(held.axes, 1, 2)).swapaxes(1, 2)
            cases.append(moved(held.turned(axes=turned)))
        return np.array(cases)

    def order(n: int) -> Array:
        length = held.t_end - held.t_start
        ends = n * held.angle_start, n * held.angle_end
        return np.array([fit.error((f(ends[1]) - f(ends[0])) / length) for f in (np.sin, np.cos)])

    def unbalance() -> Array:
        down = held.axes @ np.array([0.0, 0.0, -site.g])
        ends = []
        for a in (held.angle_start, held.angle_end):
            c, s = np.cos(a), np.sin(a)
            ends.append((c * down[:, 1] + s * down[:, 2], c * down[:, 2] - s * down[:, 1]))
        length = held.t_end - held.t_start
        y, z = (fit.error((late - early) / length) for early, late in zip(*ends, strict=True))
        return np.array([-y, z])  # a mass along z pulls with its weight along y, one along y against that along z

    def mount(k: int) -> Array:
        return moved(_mounted(held, k))

    each, phases = "each phase set up by itself", tuple(f"phase {p}" for p in np.unique(phase))
    return [
        sources.AXIS_SERVO.of(axis="y").effect(sizes, axis(1), note=each, parts=phases),
        sources.AXIS_SERVO.of(axis="z").effect(sizes, axis(2), note=each, parts=phases),
        sources.ATTITUDE_SERVO.effect(sizes, axis(0), note=each, parts=phases),
        sources.WOBBLE.effect(sizes, wobble()),
        sources.INPUT_TO_OUTPUT.effect(sizes, mount(2)),
        sources.INPUT_TO_SPIN.effect(sizes, -mount(1)),
        sources.ANGLE_ONCE.effect(sizes, order(1)),
        sources.ANGLE_TWICE.effect(sizes, order(2)),
        sources.UNBALANCE.effect(sizes, unbalance()),
        sources.TIME_BASE.effect(sizes, fit.error(-held.rate)),
    ]


def _mounted(held: HeldWindows, k: int) -> HeldWindows:
    """Return the windows with the gyro turned by SMALL about its axis k on the table."""
    return held.turned(body=frames.rotation(np.eye(3)[k], SMALL))


def candidates(
    held: HeldWindows,
    site: Location,
    columns: Callable[[HeldWindows], Array],
    phase: NDArray[np.int_],
    windows: Mapping[str, Array],
) -> list[Candidate]:
    """Return the set-up effects that a held table may have.

    Misalignment of the input axis, trend, temperature, constants that differ from phase to phase, each of which is set
    up by itself.

    columns: what is fitted.  windows: the rows of ``held``, with the thermometers of a measured record.
    """
    y, X = drift_rate(held, site), columns(held)
    start = np.linalg.lstsq(X, y, rcond=None)[0]  # the axis sees another part of the drift, too

    def misalignment(k: int) -> Array:
        other = _mounted(held, k)
        return np.asarray((drift_rate(other, site) - columns(other) @ start - (y - X @ start)) / SMALL)

    return [
        *nuisances.misalignments(misalignment, PART),
        *nuisances.common({**windows, "t_start": held.t_start, "t_end": held.t_end}),
        nuisances.scatter("mount", phase.tolist()),
    ]


def book_table(fit: Findings, combined: Mapping[str, str] | None = None, channel: str = "") -> Table:
    """Return the table of the estimates in the notation and torque sign of Hu 1981.

    combined: our name -> a combination in that notation.  channel: of a two-degree-of-freedom gyro.
    """
    rows: list[list[Any]] = channels.book_rows(fit, channel) if channel else []
    for q, value, u in zip(fit.quantities, fit.value.tolist(), fit.u.tolist(), strict=True):
        if q.name in BOOK:
            symbol, sign = BOOK[q.name]
            words = (combined or {}).get(q.name, symbol)
            rows.append([words, sign * value / q.scale, u / q.scale, q.unit, q.title, "+" if sign > 0 else "−"])
    return Table(
        "notation_of_hu_1981",
        "Notation of Hu 1981",
        f"Of the line of the {channel} axis of 3-95; last column: sign against this report"
        if channel
        else "Torque sign, ω_M = −ω_d; last column: sign against this report",
        ["Hu 1981", "estimate", "u of type A", "unit", "this report", "sign"],
        rows,
    )


def conventions(channel: str = "") -> tuple[str, ...]:
    """Return the conventions of a servo test, with the axes of a channel of a two-degree-of-freedom gyro."""
    if not channel:
        return CONVENTIONS
    axes, torquer = {"x": ("x, y, z", "y"), "y": ("y, −x, z", "x")}[channel]
    own = (
        f"The {channel} axis of a two-degree-of-freedom gyro is held as a gyro with I, O, S = {axes}; in the names "
        f"D{channel}_… X, Y, Z are along x, y, z. The torquer about {torquer}, which precesses it, is idle; the other "
        "axis is locked by its rebalance loop."
    )
    return (*CONVENTIONS, own)


CONVENTIONS = (
    "Drift ω_d in precession sign: table rate plus Earth rate along the input axis; ω_M of Hu 1981 is −ω_d.",
    "X, Y, Z = −f/g0 along the input, output and spin reference axes (sign of Hu 1981: a body axis that points up "
    "reads −1); g0 = 9.80665 m/s². Against +f/g0 the linear coefficients change sign.",
    "Gyro axes x = input, y = output, z = spin axis (I, O, S), right-handed; the input axis lies along the table axis; "
    "table angle right-handed about it; local frame east, north, up. Torquer idle while the gyro holds the table.",
)
