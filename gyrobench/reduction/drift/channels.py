"""A fit in the names of a floated gyro, reported in those of a channel of a gyro with two degrees of freedom.

(I, O, S) = (x, y, z) for the x channel, (y, -x, z) for the y channel: D_IS is Dx_xz, and D_IO is -Dy_xy.
[GYRO-STATIC-2DOF; Hu 1981, section 3.3, item 6, fig. 3-35, eq. 3-95]
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from gyrobench import drift
from gyrobench.arrays import Array
from gyrobench.component.set_up import Errors
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.estimation.quantity import Quantity
from gyrobench.reduction.setup.run_metadata import truth_of

CHANNELS = ("x", "y")
#: the coefficients of Hu 1981 of a channel -> ours, and its sign against ours  [CROSS-MAP]
BOOK: dict[str, dict[str, tuple[str, int]]] = {
    "x": {
        "R_x": ("Dx_0", -1), "U_z": ("Dx_x", -1), "U_x": ("Dx_z", 1), "K_zz − K_xx": ("Dx_xz", -1),
        "K_zx": ("Dx_xx", -1), "K_xz": ("Dx_zz", 1), "K_zy": ("Dx_xy", -1), "K_xy": ("Dx_yz", 1),
    },
    "y": {
        "R_y": ("Dy_0", 1), "U_z": ("Dy_y", -1), "U_y": ("Dy_z", 1), "K_yy − K_zz": ("Dy_yz", 1),
        "K_zy": ("Dy_yy", -1), "K_yz": ("Dy_zz", 1), "K_zx": ("Dy_xy", -1), "K_yx": ("Dy_xz", 1),
    },
}  # fmt: skip
_TERM = re.compile(r"([+−]?)( ?[^+−]*?)\b(D_[FIOS]{1,2})\b")


def truth_in(run: RunDocument, channel: str) -> dict[str, float] | None:
    """Return the drift coefficients of the simulated gyro, of a channel in the names and signs of a floated gyro."""
    if channel not in CHANNELS:
        return truth_of(run, drift.NAMES)
    own = {drift.name_2dof(channel, n): n for n in drift.NAMES}
    found = truth_of(run, own)
    return None if found is None else {own[n]: drift.sign_2dof(channel, own[n]) * v for n, v in found.items()}


def errors_in(errors: Errors, channel: str) -> Errors:
    """Return simulated errors of the set-up, a gyro turned about its x, y, z axes as one turned about I, O, S.

    About O = -x the y channel is turned by minus the angle about x: its input axis then leans towards the spin axis.
    """
    if channel != "y":
        return errors
    about = {n: errors[n] for n in ("mount.1", "mount.2") if n in errors}
    kept = {n: x for n, x in errors.items() if n not in (*about, "mount.input_to_spin")}
    if isinstance(x := about.get("mount.1"), float):
        kept |= {"mount.2": -x, "mount.input_to_spin": x}
    return kept | ({"mount.1": about["mount.2"]} if "mount.2" in about else {})


def words(text: str, channel: str) -> str:
    """Return combinations such as "D_F + γ² sin²φ D_II; D_O" in the names of a channel."""
    if channel not in CHANNELS:
        return text
    return ";".join(_combination(part, channel) for part in text.split(";"))


def _combination(text: str, channel: str) -> str:
    first = _TERM.search(text)
    turned = 1 if first is None else drift.sign_2dof(channel, first[3])  # the whole stands for a positive first term

    def one(term: re.Match[str]) -> str:
        sign, factor, name = term.groups()
        if turned * drift.sign_2dof(channel, name) < 0:
            sign = {"+": "−", "−": "+"}.get(sign, sign)
        return f"{sign}{factor}{drift.name_2dof(channel, name)}"

    return _TERM.sub(one, text)


def in_channel(found: Findings, channel: str) -> Findings:
    """Return the fit with its drift coefficients reported as those of a channel; the same fit for a floated gyro."""
    if channel not in CHANNELS:
        return found
    own = found.quantities[: len(found.quantities) - len(found.joined)]
    signs = np.array([drift.sign_2dof(channel, q.name) for q in own], dtype=float)
    before = found.function

    def turned(beta: Array) -> Array:
        return np.asarray(signs * (beta if before is None else np.asarray(before(beta))))

    return found.derive([_named(q, channel, float(s)) for q, s in zip(own, signs, strict=True)], turned)


def _named(q: Quantity, channel: str, sign: float) -> Quantity:
    name = drift.name_2dof(channel, q.name)
    return replace(
        q,
        name=name,
        meaning=q.meaning.replace(drift.meaning(q.name), drift.meaning(name)),
        truth=None if q.truth is None else sign * q.truth,
        closed=None if q.closed is None else sign * q.closed,
        shown=words(q.shown, channel),
        combination={
            drift.name_2dof(channel, n): sign * drift.sign_2dof(channel, n) * v for n, v in q.combination.items()
        },
    )


def typst(channel: str, left: str, names: Iterable[str]) -> str:
    """Return the measurement equation of a channel, Typst math; names: of a floated gyro."""
    return left + drift.typst_2dof(channel, (drift.name_2dof(channel, n) for n in names))


def book_rows(found: Findings, channel: str) -> list[list[object]]:
    """Return rows of estimates of a channel in the notation of Hu 1981, eq. 3-95."""
    at: Mapping[str, int] = {q.name: k for k, q in enumerate(found.quantities)}
    rows: list[list[object]] = []
    for symbol, (ours, sign) in BOOK[channel].items():
        if ours in at:
            q, k = found.quantities[at[ours]], at[ours]
            value, u = float(found.value[k]) / q.scale, float(found.u[k]) / q.scale
            shown = symbol if q.title == ours else f"{symbol} in {q.title}"
            rows.append([shown, sign * value, u, q.unit, q.title, "+" if sign > 0 else "−"])
    return rows
