"""Frequency responses of the linear models that a record holds: A, B, C, D and a step (s; 0: continuous)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gyrobench.record.run_document import LinearModel

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
TOLERANCE = 0.05  # relative, of a crossover against the requested one


def model_response(model: LinearModel, f: Sequence[float] | Array) -> Complex:
    """Return the frequency response of a model: array (frequency, output, input)."""
    a, b, c, d = (np.asarray(m, float) for m in (model.A, model.B, model.C, model.D))
    n = len(model.states)
    a, b, c = a.reshape(n, n), b.reshape(n, len(model.inputs)), c.reshape(len(model.outputs), n)
    d = d.reshape(len(model.outputs), len(model.inputs))
    s = 2j * np.pi * np.asarray(f, float)
    s = np.exp(s * model.step) if model.step else s
    states = np.linalg.solve(s[:, None, None] * np.eye(n) - a, np.broadcast_to(b, (s.size, *b.shape)).astype(complex))
    return np.asarray(c @ states + d)
