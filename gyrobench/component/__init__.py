"""The part: declarations, the language of its equations, the class that steps them.

Of gyrobench this package imports only ``errors``: a Python FMU carries a copy of both.
"""

from gyrobench.component.component import Component
from gyrobench.component.composition import Block, ComponentError, sampled
from gyrobench.component.declarations import Declaration, Discrete, Input, Noise, Output, Parameter, Scalar, State
from gyrobench.component.rotation import IDENTITY, Rotation

__all__ = [
    "IDENTITY", "Block", "Component", "ComponentError", "Declaration", "Discrete", "Input", "Noise", "Output",
    "Parameter", "Rotation", "Scalar", "State", "sampled",
]  # fmt: skip
