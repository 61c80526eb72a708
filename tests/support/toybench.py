"""What the tests of packaging share: the standard parts, the toys beside this file, the head of written ones."""

from __future__ import annotations

from pathlib import Path

from gyrobench.bench import Bench, standard_folder

PARTS = sorted(Bench(standard_folder()).parts())
TARGETS = ("native", "python")
FORMS = ("native", "python", "native-fmi3")
TOYS = Path(__file__).parents[1] / "packaging" / "toys"

HEAD = """\
from __future__ import annotations
import math
from gyrobench.component import Component, Discrete, Input, Noise, Output, Parameter, State, sampled
from gyrobench.component.math import *

GAIN = 2.5
class Toy(Component):
    \"\"\"A toy.\"\"\"
"""
