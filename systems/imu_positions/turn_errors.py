"""What readings at rest and the level Earth rate do to the data of the turns.

Each reading is in the data of two turns, and through the nine unknowns of the accelerometers in those of all.
"""

from __future__ import annotations

import numpy as np

from gyrobench.arrays import Array

from . import hand_noise, norms, turns
from .hand_positions import Positions
from .turns import Turn

STEP = 1e-6  # rad/s
SIZES, GUESSES = (1e-3, 1e5), 65  # variance of the turns over that of the readings at rest


def whitener(at: Positions, X: Array, y: Array) -> Array:
    """Return a symmetric matrix (2 n, 2 n) that makes the noise of the data y, with regressors X, white and alike.

    The noise is that of the readings at rest, whose size is known, and one of the turns, which grows with their time
    (white noise of a rate) and besides; its size is the likeliest (restricted likelihood).  Typical data keep theirs.
    """
    rest = at.noise_a**2 * _square(of_accelerometers(at)) + at.noise_g**2 * _square(of_gyros(at))
    span = np.array([t.time[-1] - t.time[0] for t in at.found.turned])
    own = np.diag(np.repeat(0.5 * (1.0 + span / np.median(span)), 2))
    usual = float(np.mean(np.diag(rest)))
    sizes = usual * np.concatenate([[1e-6], np.geomspace(*SIZES, GUESSES)])
    best = min(sizes, key=lambda size: sum(hand_noise.restricted(rest + size * own, X, y)))
    return hand_noise.whitener(rest + best * own)


def _square(errors: Array) -> Array:
    return np.asarray(errors.T @ errors)


def of_level_rate(at: Positions) -> Array:
    """Return the errors (2, 2 n) of the data for each component of the level Earth rate, 1 rad/s.

    The readings at rest hold it, and the turning Earth carries the start of a turn along.
    """
    own, errors = at.found, []
    clean = turns.left(own.turned, own.matrix)
    for axis in range(2):
        moved = []
        for t in own.turned:
            k = t.at
            rest = 0.5 * (own.level[k][axis] + own.level[k + 1][axis])
            span = float(t.time[-1] - t.time[0])
            before = t.before + STEP * span * np.cross(own.level[k][axis], t.before)
            moved.append(Turn(t.time, t.rate + STEP * rest, before, t.after))
        # a rate that the model lacks: the opposite of what it changes
        errors.append(-(turns.left(moved, own.matrix) - clean) / STEP)
    return np.array(errors)


def of_accelerometers(at: Positions) -> Array:
    """Return the errors (3 N, 2 n) of the data for the reading of each accelerometer in each position, 1 m/s2: by the
    directions of gravity before and after a turn, and by the nine unknowns, which are found from all positions.
    """
    count, C = len(at.up), at.triad.inverse
    J = norms.slopes(at.triad, at.acc / at.scale_a[0])
    fitted = -np.linalg.pinv(J)[:, :, None] * (at.up @ C)[None]  # (9, N, 3): of the unknowns, for each reading
    forces = np.zeros((count, 3, count, 3))  # change of the force of a position, for each reading
    for k in range(count):
        for i, (row, column) in enumerate(norms.PLACES):
            forces[k] -= np.multiply.outer(C[:, row] * at.force[k, column], fitted[i])
        forces[k] -= np.tensordot(C, fitted[6:], axes=1)
        forces[k, :, k] += C
    across = (np.eye(3) - at.up[:, :, None] * at.up[:, None, :]) / np.linalg.norm(at.force, axis=1)[:, None, None]
    directions = (across @ forces.reshape(count, 3, -1)).reshape(count, 3, -1)
    inverse = np.asarray(np.linalg.inv(np.eye(3) + at.found.matrix), dtype=float)
    rows = [t.tangents @ (t.rotation(inverse).T @ directions[t.at] - directions[t.at + 1]) for t in at.found.turned]
    return np.concatenate(rows).T


def of_gyros(at: Positions) -> Array:
    """Return the errors (3 N, 2 n) of the data for what each gyro reads at rest in each position, 1 rad/s: half of the
    bias of both turns.
    """
    own = at.found
    out = np.zeros((len(at.up), 3, 2 * len(own.turned)))
    clean = turns.left(own.turned, own.matrix)
    for axis in range(3):
        half = 0.5 * STEP * np.eye(3)[axis]
        moved = [Turn(t.time, t.rate - half, t.before, t.after) for t in own.turned]
        change = (turns.left(moved, own.matrix) - clean) / STEP
        for k, t in enumerate(own.turned):
            both = slice(2 * k, 2 * k + 2)
            out[t.at, axis, both] += change[both]
            out[t.at + 1, axis, both] += change[both]
    return out.reshape(-1, 2 * len(own.turned))
