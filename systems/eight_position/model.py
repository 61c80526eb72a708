"""The measurement equation of both currents as a linear fit, and what its unknowns are for a gyro with compliance.

    k_x I_x = w_y - R_x + u_zx g_y - u_y g_z - q_y g_y^2 - s_y g_x        (g_x, g_y, g_z): direction of gravity (down)
    k_y I_y = w_x + R_y + u_zy g_x - u_x g_z - q_x g_x^2 - s_x g_y        (w_x, w_y): Earth rate along x, y

About a first least squares of I itself, which is linear in (1/k, R/k, u/k) [POS8-LS], the drift y = w - k0 I is linear
in k - k0 and in all other unknowns.  In these positions no two of g_x, g_y, g_z differ from 0 at once and g_z = -1 or
0, so products are not seen and g_z^2 = -g_z: with gamma = g/g0 and the coefficients of gyrobench.drift [POS8-QUAD]

    R_x = Dy_0 + gamma^2 Dy_xx               R_y = -(Dx_0 + gamma^2 Dx_yy)
    u_zx = -gamma Dy_y                       u_zy = -gamma Dx_x
    u_y = gamma Dy_z - gamma^2 (Dy_zz - Dy_xx)   u_x = gamma Dx_z - gamma^2 (Dx_zz - Dx_yy)
    q_y = gamma^2 (Dy_yy - Dy_xx), s_y = gamma Dy_x      q_x = gamma^2 (Dx_xx - Dx_yy), s_x = gamma Dx_y

Dy_xx and Dx_yy have no physical cause; without them the u_y of Hu 1981 is u_y - K_yz g^2 and u_x is u_x - K_xz g^2.
With four unknowns q and s are taken as zero.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy import special

from gyrobench import frames, units
from gyrobench.reduction.drift.pulses import Pulses
from gyrobench.reduction.estimation import regression
from gyrobench.reduction.estimation.reported import Estimates
from gyrobench.reduction.toolkit import Array, Findings, Quantity, ReductionError, SiteSetup, plain

from . import positions

SMALL = 1e-5  # rad, step of the perturbations
MEANING = {
    "k_x": "scale factor of the torquer about x",
    "k_y": "scale factor of the torquer about y",
    "R_x": "constant drift about y (torque about x over H)",
    "R_y": "minus the constant drift about x (torque about y over H)",
    "u_x": "mass unbalance along x at local g, minus the compliance K_xz g²",
    "u_y": "mass unbalance along y at local g, minus the compliance K_yz g²",
    "u_zx": "mass unbalance along z with the outer gimbal, at local g",
    "u_zy": "mass unbalance along z without the outer gimbal, at local g",
    "Dy_yy − Dy_xx": "y channel, compliance along y, less the empirical term along x",
    "Dx_xx − Dx_yy": "x channel, compliance along x, less the empirical term along y",
    "Dy_x": "y channel, per g along x (empirical)",
    "Dx_y": "x channel, per g along y (empirical)",
}
#: parameters of the simulated gyro that are truth here
TRUE = ("k_x", "k_y", *(f"D{c}_{a}" for c in "xy" for a in ("0", "x", "y", "z", "xx", "yy", "zz")))
EXTRA = {"x": ("Dy_yy − Dy_xx", "Dy_x"), "y": ("Dx_xx − Dx_yy", "Dx_y")}


@dataclass(frozen=True, kw_only=True)
class EightPositionSetup(SiteSetup):
    """terms: unknowns of a channel, 4 or 6.  sigma: two cycles are needed.  truth: coefficients Dx_0 ... Dy_xz (rad/s
    per g0^n), k_x, k_y of a simulated gyro.  quantum: resolution of the current readings.  u_nonlinearity: relative, at
    the largest current.
    """

    terms: int = 6
    sigma: bool = True
    quantum: Mapping[str, float] = field(default_factory=dict)
    pulses: Mapping[str, Pulses | None] = field(default_factory=dict)  # of pulse-width rebalances, by channel


def directions(position: NDArray[np.int_], latitude: float, turned: Mapping[int, Array] | None = None) -> Array:
    """Return (n, 2, 3): unit vectors of Earth rate and gravity in gyro axes; ``turned``: attitudes in place of the
    nominal.
    """
    known = {**positions.ATTITUDES, **(turned or {})}
    each = {n: np.stack(positions.earth_and_gravity(a, latitude)) for n, a in known.items()}
    return np.array([each[n] for n in position.tolist()])


def rate(channel: str, d: Array, earth_rate: float) -> Array:
    """Return the Earth rate (rad/s) that the current of ``channel`` measures."""
    return earth_rate * d[:, 0, 1 if channel == "x" else 0]


def drift_columns(channel: str, d: Array, terms: int) -> Array:
    """Return the columns of the drift w - k I of a channel: R, u, u_z and, with six terms, q, s; unit: rad/s each."""
    g = d[:, 1]
    along, across = (g[:, 1], g[:, 0]) if channel == "x" else (g[:, 0], g[:, 1])
    constant = np.ones_like(along) if channel == "x" else -np.ones_like(along)
    columns = [constant, g[:, 2], -along, along * along, across]
    return np.stack(columns[: terms - 1], axis=1)


@dataclass(frozen=True)
class LinearCurrent:
    """y = X a for a current: X (n, terms), y (n,) in rad/s; unknowns k - k0 (rad/s/A), R, u, u_z, q, s (rad/s)."""

    k0: float
    start: Array  # first estimate of all but k, rad/s
    X: Array
    y: Array


def linear(channel: str, current: Array, d: Array, setup: EightPositionSetup) -> LinearCurrent:
    """Return the fit of one current (A).  Raises ReductionError where the current does not depend on the Earth's
    rate.
    """
    w, D = rate(channel, d, setup.earth_rate), drift_columns(channel, d, setup.terms)
    names = (*positions.UNKNOWNS[channel], *EXTRA[channel])[: setup.terms]
    A = np.column_stack([w, -D])
    seen = regression.examine(A, names)
    if seen.rank < setup.terms:
        raise ReductionError(f"{channel} current: rank {seen.rank} of {setup.terms}, lost: {'; '.join(seen.lost)}")
    beta = np.linalg.lstsq(A / np.linalg.norm(A, axis=0), current, rcond=None)[0] / np.linalg.norm(A, axis=0)
    a, b = ("1", "3") if channel == "x" else ("2", "4")
    if not abs(beta[0]) * setup.earth_rate > 1e-9 * float(np.max(np.abs(current))):
        raise ReductionError(
            f"I_{channel}{a} = I_{channel}{b}: the current does not depend on the Earth's rate, so there is no scale "
            f"factor k_{channel}; was the gyro turned, is its rebalance loop closed, are x and y exchanged?"
        )
    k0, start = 1.0 / float(beta[0]), beta[1:] / float(beta[0])
    if k0 < 0.0:
        raise ReductionError(
            f"k_{channel} = {plain(k0, 6)} rad/s/A is negative: positive current must precess positively; turn the "
            f"sign of the {channel} current round (or the positions {a} and {b} are exchanged)"
        )
    predicted = (w - D @ start) / k0
    return LinearCurrent(k0, start, np.column_stack([predicted, D]), w - k0 * current)


def turned(axis: str, angle: float, numbers: tuple[int, ...]) -> dict[int, Array]:
    """Return attitudes with the gyro turned by ``angle`` (rad) about its own ``axis`` in the positions ``numbers``."""
    R = frames.rotation(np.eye(3)["xyz".index(axis)], angle)
    return {n: R.T @ positions.ATTITUDES[n] for n in numbers}


def attitude_error(
    channel: str, setup: EightPositionSetup, found: Findings, lin: LinearCurrent, position: NDArray[np.int_],
    attitudes: dict[int, Array],
) -> Array:  # fmt: skip
    """Return the error of the data (n,) when the positions were ``attitudes`` and the nominal ones are believed."""
    believed = directions(position, setup.latitude)
    real = directions(position, setup.latitude, attitudes)
    # y = w - k I is formed with the believed w while k I = w_real - drift_real
    dw = rate(channel, real, setup.earth_rate) - rate(channel, believed, setup.earth_rate)
    D = drift_columns(channel, real, setup.terms) - drift_columns(channel, believed, setup.terms)
    return found.error(D @ lin.start - dw)


def quantities(channel: str, setup: EightPositionSetup, closed: Mapping[str, float]) -> list[Quantity]:
    """Return what is reported of a channel: k, R, u, u_z and, with six terms, the two differences per g0^n."""
    true = truth(setup)
    found = []
    for name in (*positions.UNKNOWNS[channel], *EXTRA[channel])[: setup.terms]:
        if name.startswith("D"):
            unit = units.display("deg/h/g2" if "−" in name else "deg/h/g")
            found.append(
                Quantity(
                    name, MEANING[name], unit, units.factor("deg/h"), true.get(name), combination=made_of(name, setup)
                )
            )
        else:
            unit = "deg/h/mA" if name.startswith("k") else "deg/h"
            q = Quantity.of(name, MEANING[name], unit, true.get(name), closed.get(name))
            found.append(replace(q, combination=made_of(name, setup)))
    return found


def made_of(name: str, setup: EightPositionSetup) -> dict[str, float]:
    """Return the coefficients behind an unknown, per g0^n; Dy_xx and Dx_yy folded into the others."""
    g = setup.gamma
    return {
        "R_x": {"Dy_0": 1.0},
        "R_y": {"Dx_0": -1.0},
        "u_zx": {"Dy_y": -g},
        "u_zy": {"Dx_x": -g},
        "u_y": {"Dy_z": g, "Dy_zz": -g * g},
        "u_x": {"Dx_z": g, "Dx_zz": -g * g},
        "Dy_yy − Dy_xx": {"Dy_yy": 1.0},
        "Dx_xx − Dx_yy": {"Dx_xx": 1.0},
    }.get(name, {name: 1.0})


def reported(found: Findings, wanted: list[Quantity], setup: EightPositionSetup, k0: float) -> Findings:
    """Return the unknowns of a current in the form of :func:`quantities`: k = k0 + (k - k0), compliance per g0^n."""
    r, after = found.reported, found.quantities[len(wanted) :]  # effects of the nuisance model stay as they are
    factor, offset = np.ones(r.value.size), np.zeros(r.value.size)
    offset[0] = k0
    factor[4 : len(wanted)] = np.array([1.0 / setup.gamma**2, 1.0 / setup.gamma])[: len(wanted) - 4]
    p = np.array(r.p)
    p[0] = 2.0 * special.stdtr(min(float(r.dof[0]), 1e9), -k0 / r.u[0]) if r.u[0] > 0.0 else 0.0
    values = Estimates(
        offset + factor * r.value, r.covariance * np.outer(factor, factor), r.u * factor, r.half_width * factor, p,
        r.dof, factor[:, None] * r.gain,
    )  # fmt: skip
    return replace(found, quantities=(*wanted, *after), reported=values)


def truth(setup: EightPositionSetup) -> dict[str, float]:
    """Return what the unknowns are for the simulated gyro, SI; empty without truth."""
    t = setup.truth
    if not t:
        return {}
    g = setup.gamma
    D = {n: float(t.get(n, 0.0)) for c in "xy" for n in (f"D{c}_{a}" for a in ("0", "x", "y", "z", "xx", "yy", "zz"))}
    found = {
        "R_x": D["Dy_0"] + g * g * D["Dy_xx"],
        "R_y": -(D["Dx_0"] + g * g * D["Dx_yy"]),
        "u_zx": -g * D["Dy_y"],
        "u_zy": -g * D["Dx_x"],
        "u_y": g * D["Dy_z"] - g * g * (D["Dy_zz"] - D["Dy_xx"]),
        "u_x": g * D["Dx_z"] - g * g * (D["Dx_zz"] - D["Dx_yy"]),
        "Dy_yy − Dy_xx": D["Dy_yy"] - D["Dy_xx"],
        "Dx_xx − Dx_yy": D["Dx_xx"] - D["Dx_yy"],
        "Dy_x": D["Dy_x"],
        "Dx_y": D["Dx_y"],
    }
    return found | {n: float(t[n]) for n in ("k_x", "k_y") if n in t}
