"""Sizes of type B for tests of sensitivities.

A stated error is in the covariance of the data and moves the weights of the fit, so a budget has the sensitivities of
these weights.  Stated at FAINT of its size it moves none: the lines, over FAINT, are what the error does to a run in
which nothing is stated.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

FAINT = 1e-9


def with_sizes(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of a setup; those named as options, u_NAME, are its sizes."""
    sizes = {n: v for n, v in values.items() if n.startswith("u_")}
    return {**{n: v for n, v in values.items() if n not in sizes}, "sizes": {**values.get("sizes", {}), **sizes}}
