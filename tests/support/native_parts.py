"""Native parts of the standard bench in tests: each is built, unzipped and its description read once a process."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from fmpy import read_model_description

from gyrobench.bench import standard_folder
from gyrobench.files import temporary_folder, unzip_fmu
from gyrobench.packaging import build, instance
from gyrobench.packaging.instance import Fmu, Instance, Unzipped


@functools.cache
def native_files(name: str) -> Unzipped:
    """Return the native FMU of a part, unzipped."""
    folder = temporary_folder()
    path = build(name, "native", out=folder, bench=standard_folder())
    unzip_fmu(path, folder)
    return Unzipped(read_model_description(str(path), validate=False), folder)


def make(part: str, target: str) -> Instance:
    """Return a new instance as gyrobench's ``make`` does; native ones share their files.

    Of estimator_wavelet it takes 0.1 s to unzip them and to read the 6600 variables.
    """
    if target != "native":
        return instance.make(part, target, bench=standard_folder())
    files = native_files(part)
    return Fmu(files.folder / f"{part}.fmu", like=files)


def stepped(part: Any, until: float, names: Any, h: float = 1e-3, **values: float) -> np.ndarray:
    """Set values, initialize, step; return these outputs after each step."""
    part.set({k: float(v) for k, v in values.items()})
    part.initialize()
    found = []
    for k in range(round(until / h)):
        part.step(k * h, h)
        found.append(part.get(names))
    return np.array(found)
