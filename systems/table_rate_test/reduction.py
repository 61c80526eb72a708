"""Reduction of the rate test: rates from counts, gates and inverse rate, tracking, ripple, torque of the changes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import special

from gyrobench.frames import EARTH_RATE as ERU
from gyrobench.reduction.diagnosis.unshown import ARRANGEMENT
from gyrobench.reduction.estimation.fit_result import UNSTATED
from gyrobench.reduction.loops.loop_toolkit import ARCSEC, Account, MeasureReduction, line, over_time, told, trace
from gyrobench.reduction.toolkit import Array, Record, ReductionError, RunDocument, Source, plain, window_problems
from gyrobench.result import BudgetLine, Reason, Response, Table

from .axis_as_data import SampledLoopError, margins_table
from .closed_form import SampledLoop
from .sources import COUNTS, CYCLE, NOISE, ONCE, TWICE

PPM = 1e-6
WRONG = 0.02  # a scale of times or angles
SHOWN = 1500  # intervals of a drawn line
RAMP = 0.6  # s of a change of rate that is drawn
BEYOND = 1e-3  # p of a scatter that rounding does not explain
#: errors of the readings by cycles a turn, u of their amplitudes; the last: twice in a cycle of the scale
SCALE = ((1.0, ONCE), (2.0, TWICE), (None, CYCLE))
READOUTS = (
    "Relative errors of the rate by counts over the whole phase, by the last gate and by the last interval of the "
    "inverse rate; tracking error and standard deviation of the true rate"
)
COLUMNS = (
    "rate / ERU", "by counts / 1e-6", "u / 1e-6", "last gate / 1e-6", "last interval / 1e-6", "mean error / ″",
    "std of error / ″", "true rate ripple / ERU",
)  # fmt: skip


@dataclass(frozen=True)
class AtRate:
    """What was read at one rate, one sense: the columns of its windows; errors relative to the rate commanded.

    Rates are from the end of the first window to the end of the last: there both ends are found alike, at the sample in
    which the count of a window's end appears.
    """

    rate: float  # commanded, rad/s
    rows: Mapping[str, Array]

    def turned(self, name: str = "angle_end") -> float:
        """Return the change of a column from the first to the last window."""
        return float(self.rows[name][-1] - self.rows[name][0])

    def relative(self, name: str) -> float | None:
        """Return the relative error of the mean rate by a column of angles; None without the column."""
        return self.turned(name) / self.turned("t_end") / self.rate - 1.0 if name in self.rows else None

    def shown(self, name: str) -> float | None:
        """Return the relative error of the last reading of a readout that lies in this phase."""
        last = {n: float(x[-1]) for n, x in self.rows.items()}
        if last.get(f"{name}_valid") != 1.0 or last[f"{name}_start"] < self.rows["t_start"][0]:
            return None
        return last[name] / self.rate - 1.0

    @property
    def error(self) -> float:
        """Return the relative error by counts."""
        return self.relative("angle_end") or 0.0

    @property
    def angle(self) -> float:
        """Return the angle it is taken over, rad."""
        return abs(self.turned())

    @property
    def mean(self) -> float:
        """Return the mean tracking error, rad."""
        return float(np.mean(self.rows["mean"][1:]))

    @property
    def ripple(self) -> tuple[float, float]:
        """Return the standard deviation of the tracking error, rad, and its u from what differs between windows."""
        each = self.rows["std"][1:]
        return _rms(each), float(np.std(each, ddof=1) / math.sqrt(each.size))

    @property
    def scatter(self) -> tuple[float, int]:
        """Return sum of squares (rad2) and degrees of freedom of the angles at the ends of windows about their line."""
        t, angle = (self.rows[n] - self.rows[n][0] for n in ("t_end", "angle_end"))
        X = np.column_stack([np.ones_like(t), t])
        rest = angle - X @ np.linalg.lstsq(X, angle)[0]
        return float(rest @ rest), len(t) - 2


def _rms(x: Array) -> float:
    return float(np.sqrt(np.mean(x**2)))


def scale_parts(run: RunDocument, angle: float) -> list[tuple[Source, float, float]]:
    """Return sources, u of their amplitudes (rad) and what of it is in the difference of two readings this angle apart.

    An amplitude A with any phase errs by A sqrt(1 - cos n angle) rms; whole turns cancel.
    """
    cycle = 2.0 * float(run.parameters.get("reader.pole_pairs", 360.0))
    parts = [(s, s.size(run.options), math.sqrt(max(0.0, 1.0 - math.cos((n or cycle) * angle)))) for n, s in SCALE]
    return [p for p in parts if p[1]]


def time_base(pairs: Mapping[float, Sequence[AtRate]], quantum: float) -> tuple[float, float, float]:
    """Return the relative error that all rates have in common, its u and the coverage factor of 95 %.

    A reading errs by its rounding and by the motion of the table: the scatter of the angles at the ends of windows says
    by how much, at each rate, and not less than by rounding.  The tracking error does not say it: the roundings of
    command and reading go together where the table follows well.
    """
    weight, error, doubt = 0.0, 0.0, 0.0
    for both in pairs.values():
        squares, dof = (sum(x) for x in zip(*(r.scatter for r in both), strict=True))
        one = max(squares / dof, quantum**2 / 12.0)
        w = np.array([r.angle**2 / (2.0 * one) for r in both])
        weight, error = weight + float(w.sum()), error + float(w @ [r.error for r in both])
        doubt += float(w.sum()) ** 2 / dof
    return error / weight, 1.0 / math.sqrt(weight), float(special.stdtrit(weight**2 / doubt, 0.975))


class Reduction(MeasureReduction):
    """Each rate in both senses by the counts; torque of the largest change of rate beside the linear loop's."""

    part = "controller"

    def measure(self) -> Account:
        """Measure rates, tracking and torque.  Raises ReductionError."""
        run, w, found = self.run, self.record.windows, self.found
        if problems := window_problems(w):
            raise ReductionError(problems)
        self.quantum = float(run.parameters.get("reader.quantum") or 0.0)
        if not self.quantum:
            raise ReductionError("quantum of the angle reader unknown: reader.quantum is not in the record")
        picks = [(float(row.target), np.flatnonzero(w["phase"] == row.phase)) for row in run.plan]
        columns = {n: np.asarray(x, dtype=float) for n, x in w.items()}
        self.readings = [AtRate(r, {n: x[p] for n, x in columns.items()}) for r, p in picks if p.size >= 3]
        if not self.readings:
            raise ReductionError("no phase has three windows: nothing to reduce")
        self.rates = sorted({abs(r.rate) for r in self.readings})
        pairs = {rate: [r for r in self.readings if abs(r.rate) == rate] for rate in self.rates}
        self.ranked_by = f"ripple {plain(self.rates[-1] / ERU, 6)} ERU"
        clock, u, k = time_base(pairs, self.quantum)
        true = run.parameters.get("command.reference_clock")
        found.measure("time base", "relative error of the command's time base, all rates", "1e-6", clock, u, scale=PPM,
                      k=k, truth=None if true is None else float(true))  # fmt: skip
        for rate, both in pairs.items():
            self._error(f"error {plain(rate / ERU, 6)} ERU", both)
        self._noise(pairs)
        self._scales()
        for rate, both in pairs.items():
            sizes, u_each = zip(*(r.ripple for r in both), strict=True)
            found.measure(f"ripple {plain(rate / ERU, 6)} ERU", "standard deviation of the tracking error", "arcsec",
                          _rms(np.array(sizes)), math.hypot(*u_each) / len(both), scale=ARCSEC)  # fmt: skip
        rows = [self._row(r) for r in self.readings]
        self._axis()
        found.tables.append(Table("rates.readouts", "Rates by the three readouts", READOUTS, COLUMNS, rows))
        limited = int(np.sum(w["flagged"] > 0.0)) if "flagged" in w else 0
        text = (
            f"The controller demanded its limit in {limited} windows. The mean rates there are those of a saturated "
            "loop. Reduce the load or the jitter of the counts."
        )
        found.warn("controller.limit", text if limited else "")
        if "controller.e" in self.record.channels:
            found.responses.append(_tracking(self.record))
        self._change_of_rate()
        return Account(
            method="Mean rate from cumulative counts at each commanded rate, both senses; gates and inverse rate "
            "beside it",
            sources=["TABLE-RATE, READOUT-RATE, CTRL-SAMPLED; Hu 1981, sections 5.4, 5.5, 6.1, corrected by ET4, ET22"],
            equation="r = q (n_2 - n_1)\\/(t_2 - t_1), quad u^2(r) (t_2 - t_1)^2 = q^2\\/6 + sum u_n^2 "
            "(1 - cos n theta)",
            conventions=[
                "Relative errors: rate read over rate commanded, less 1. 1 ERU = 7.2921159e-5 rad/s.",
                "Tracking error: command count less count, times the quantum; it holds no error of the scale, which "
                "the servo follows.",
                "The true rate ripple (table of the readouts) is that of the simulated body; no instrument of the test "
                "reads it.",
            ],
        )

    def summary(self) -> list[str]:
        worst = max(self.readings, key=lambda r: abs(r.mean) + 2.0 * r.ripple[0])
        largest, at = abs(worst.mean) + 2.0 * worst.ripple[0], f"{worst.rate / ERU:+.6g}".replace("-", "−")
        span = f"{plain(self.rates[0] / ERU, 4)} to {plain(self.rates[-1] / ERU, 6)} ERU"
        return told(
            self.found.coefficients,
            f"Time base of the command, from {len(self.readings)} runs at {span}: {{time base}}.",
            f"Largest tracking error (mean and two standard deviations) {plain(largest / ARCSEC)}″, at {at} ERU (1.5″ "
            "allowed).",
        )

    def _error(self, name: str, both: Sequence[AtRate]) -> None:
        """Measure the error of a rate, both senses, with its budget.

        The counts err at each reading anew, the scale errs alike over the same angles.
        """
        angle = min(r.angle for r in both)
        ends = math.sqrt(2.0 / len(both))
        own = [(COUNTS, self.quantum / math.sqrt(12.0), ends), (NOISE, NOISE.size(self.run.options), ends)]
        parts = [*(x for x in own if x[1]), *scale_parts(self.run, angle)]
        shares = [(s, u / ARCSEC, f / angle / PPM * ARCSEC) for s, u, f in parts if f > 0.0]
        self.found.budget += [
            BudgetLine(s.id, s.name, u, "arcsec", f, "1e-6/arcsec", u * f, "1e-6", name) for s, u, f in shares
        ]
        known = [x for r in both if (x := r.relative("angle_true")) is not None]
        self.found.measure(
            name, "relative error of the mean rate, by counts, both senses", "1e-6",
            float(np.mean([r.error for r in both])), math.hypot(*(u * f for _, u, f in shares)) * PPM, scale=PPM,
            truth=float(np.mean(known)) if len(known) == len(both) else None,
        )  # fmt: skip

    def _noise(self, pairs: Mapping[float, Sequence[AtRate]]) -> None:
        """Ask for the noise of the reader where measured readings scatter by more than rounding does: a table that
        moves about its command has such a scatter, too, and the mean of its rates then is the true one.
        """
        if not self.run.measured or NOISE.size(self.run.options):
            return
        names, sizes = [], []
        for rate, both in pairs.items():
            squares, dof = (sum(x) for x in zip(*(r.scatter for r in both), strict=True))
            if float(special.chdtrc(dof, squares / (self.quantum**2 / 12.0))) < BEYOND:
                names.append(f"error {plain(rate / ERU, 6)} ERU")
                sizes.append(math.sqrt(squares / dof) / ARCSEC)
        text = (
            f"Angles at the ends of windows scatter by up to {plain(max(sizes, default=0.0))}″ about their line, "
            f"rounding makes {plain(self.quantum / math.sqrt(12.0) / ARCSEC)}″: the table moves, or its reader is "
            "noisy, which is not in u of the mean rates. State the noise of a reading (u_reading), if only as an "
            "upper limit."
        )
        if names:
            self.found.reasons.append(
                Reason(f"reader.noise{UNSTATED}", text, ("pass",), tuple(names), severity="doubt")
            )

    def _scales(self) -> None:
        """Ask whether times and angles of a measured record were checked: a rate is their ratio, and no residual shows
        the clock of a log or the angle of a count.
        """
        if not self.run.measured or self.run.arrangement == "checked":
            return
        moved = {
            c.name: WRONG / PPM / c.u
            for c in self.found.coefficients
            if c.name.startswith(("time base", "error")) and 0.0 < c.u < WRONG / PPM
        }
        if not moved:
            return
        said = ", ".join(f"{n} by {plain(moved[n])} u" for n in sorted(moved, key=lambda n: -moved[n])[:3])
        text = (
            f"No residual of this record would show: the times wrong by 2 %; the angles wrong by 2 % ({said}). "
            "State that units and scales were checked (arrangement = checked)."
        )
        self.found.reasons.append(Reason(ARRANGEMENT, text, ("pass",), tuple(moved), severity="doubt"))

    def _row(self, r: AtRate) -> list[float | None]:
        """Return rate by counts, gate and inverse rate, with the tracking and the true ripple."""
        noise = math.sqrt(2.0) * NOISE.size(self.run.options)
        u = (
            math.hypot(self.quantum / math.sqrt(6.0), noise, *(s * f for _, s, f in scale_parts(self.run, r.angle)))
            / r.angle
        )
        beside = [None if x is None else x / PPM for x in (r.shown("gate"), r.shown("inverse"))]
        jitter = _rms(r.rows["jitter"][1:]) / ERU if "jitter" in r.rows else None
        tracking = (r.mean / ARCSEC, r.ripple[0] / ARCSEC)
        return [r.rate / ERU, r.error / PPM, u / PPM, *beside, *tracking, jitter]

    def _axis(self) -> None:
        """Add the margins with the axis as data; a file that is gone or too short is a warning, the rates stand."""
        text = str(self.run.options.get("plant", ""))
        try:
            axis = margins_table(text, SampledLoop.of(self.run.parameters, self.run.step))
        except SampledLoopError as problem:
            self.found.warn("plant", f"No margins with the axis as data: {problem}.")
            return
        self.found.tables += [axis] if axis is not None else []

    def _change_of_rate(self) -> None:
        """Show the largest change of rate, and measure its torque where the linear loop is known."""
        run, peak = self.run, _largest_change(self.record)
        if peak is None:
            text = (
                "The channels are further apart than a sample of the controller: the torque at the changes of rate is "
                "not evaluated."
            )
            self.found.warn("channels.coarse", "" if run.measured else text)
            return
        t, e, torque, change = peak
        caption = "Tracking error (command less reading) at the largest change of rate; line: linear loop, no counts."
        name = f"change of rate by {change / ERU:+.6g} ERU"
        figure = trace(name, caption, t, e / ARCSEC, "tracking error", "arcsec", shown=t.size)
        loop = SampledLoop.of(run.parameters, run.step)
        if loop is not None:
            exact = loop.ramp(change, float(run.parameters["command.reference_acceleration"]), RAMP)
            meaning = f"largest torque demanded at the change of rate by {plain(abs(change) / ERU, 6)} ERU"
            most, closed = (float(np.max(np.abs(x))) for x in (torque, exact[2]))
            self.found.measure("peak torque", meaning, "N.m", most, loop.count_torque(self.quantum), closed=closed)
            figure = replace(figure, curves=[line("linear loop without counts", exact[0], exact[1] / ARCSEC)])
        self.found.responses.append(figure)


def _largest_change(record: Record) -> tuple[Array, Array, Array, float] | None:
    """Return time, tracking error and torque of the largest change of rate, and the change; None for coarse channels.

    The time counts from the last sample before the command changes.
    """
    c, p = record.channels, record.run.parameters
    names = ("time", "command.rate", "controller.e", "controller.demand")
    if any(n not in c for n in names) or c["time"].size < 3 or not p.get("command.reference_acceleration"):
        return None
    t, rate, e, torque = (np.asarray(c[n], dtype=float) for n in names)
    if t[1] - t[0] > 1.001 * float(p.get("controller.period", 5e-3)):
        return None
    targets = np.array([0.0, *(row.target for row in record.run.plan)])
    k = int(np.argmax(np.abs(np.diff(targets))))
    change = float(targets[k + 1] - targets[k])
    moved = (rate - targets[k]) / change
    reached = np.flatnonzero(np.abs(moved) < 1e-3)
    leaves = np.flatnonzero(moved > 1e-3)
    leaves = leaves[leaves > reached[0]] if reached.size else reached
    if leaves.size == 0:
        return None
    first = int(leaves[0]) - 1
    pick = slice(first, first + round(RAMP / (t[1] - t[0])))
    return t[pick] - t[pick][0], e[pick], torque[pick], change


def _tracking(record: Record) -> Response:
    """Return the figure of the tracking error over the run: least and largest of each of SHOWN intervals."""
    t, e = (np.asarray(record.channels[n], dtype=float) for n in ("time", "controller.e"))
    parts = np.array_split(np.arange(t.size), min(SHOWN, t.size))
    ends = np.unique([k for part in parts for k in (part[np.argmin(e[part])], part[np.argmax(e[part])])])
    caption = "Tracking error over the run, least and largest value of each interval."
    lines = {"tracking error": e[ends] / ARCSEC}
    return over_time("tracking error", t[ends], lines, unit="arcsec", caption=caption, shown=ends.size)
