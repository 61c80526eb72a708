"""What a part is: declarations, the language of its equations, the class that steps them.

This package imports nothing else of gyrobench: a Python FMU carries a copy of it.
"""

from gyrobench.component.component import Component, PartError, sampled
from gyrobench.component.declarations import (
    Declaration,
    Discrete,
    Input,
    Noise,
    Output,
    Parameter,
    Scalar,
    State,
)

__all__ = [
    "Component",
    "Declaration",
    "Discrete",
    "Input",
    "Noise",
    "Output",
    "Parameter",
    "PartError",
    "Scalar",
    "State",
    "sampled",
]
