"""Linearization of a part for python-control: gain and phase margins, poles, frequency responses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from gyrobench.component import Component, ComponentError


def jacobians(part: Component, inputs: Sequence[str], outputs: Sequence[str]) -> tuple[Any, Any, Any, Any]:
    """Return A, B, C, D of the part at its present point, numpy arrays; see :func:`state_space`."""
    import numpy as np

    for names, section in ((inputs, "input"), (outputs, "output")):
        known = [s.name for s in part.layout if s.section == section]
        for n in names:
            if n not in known:
                raise ComponentError(f"{part.instance}: no {section} {n!r}; it has {', '.join(known) or 'none'}")
    states = [s.name for s in part.states]
    all_outputs = [s.name for s in part.layout if s.section == "output"]
    rows = [all_outputs.index(n) for n in outputs]

    def columns(names: Sequence[str]) -> tuple[Any, Any]:
        both = part.tangents({n: 1.0} for n in names)
        d = np.array([b[0] for b in both], dtype=float).reshape(len(names), len(states)).T
        y = np.array([[b[1][r] for r in rows] for b in both], dtype=float).reshape(len(names), len(rows)).T
        return d, y

    a, c = columns(states)
    b, d = columns(inputs)
    return a, b, c, d


def state_space(part: Component, inputs: Sequence[str], outputs: Sequence[str]) -> Any:
    """Return the linearization of the part at its present point, as a continuous ``control.StateSpace``.

        dx' = A dx + B du        dy = C dx + D du

    ``inputs`` and ``outputs`` are FMI names ("omega[1]", "u"); the states are all of the part's, in their
    declared order; units are those declared (SI).  The derivatives are the part's own, by forward-mode
    differentiation of ``flow`` and ``outputs``: exact at a smooth point; where a limit or a quantizer is active,
    those of the branch taken.  Set inputs, and step or set states, to move the point.

    Raises ComponentError for a name that is not an input, or not an output, of the part.

    Not modelled: sampled methods and the held inputs of a communication step.
    """
    import control

    a, b, c, d = jacobians(part, inputs, outputs)
    states = [s.name for s in part.states]
    return control.ss(a, b, c, d, inputs=list(inputs), outputs=list(outputs), states=states, name=part.instance)
