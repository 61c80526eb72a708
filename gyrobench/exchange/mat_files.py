"""MATLAB .mat files (versions 4 to 7) as named series.

Three forms: arrays (``time``, ``u``), structs of arrays (``sampler.count``), and the trajectories of Modelica tools
(Dymola, OpenModelica, OMSimulator), where ``name`` lists the variables, ``dataInfo`` the table, column and sign of
each, ``data_1`` holds what is constant and ``data_2`` a row or column for each time.
"""

from __future__ import annotations

import pickle
import struct
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gyrobench.arrays import AnyArray
from gyrobench.reading import LARGEST
from gyrobench.record.csv_reader import DataError

SEVEN_THREE = "MATLAB 7.3 (HDF5), which is not read; save it with save(..., '-v7')"
MOST = 1 << 31  # bytes of the arrays together
LAYOUT = ("Aclass", "name", "dataInfo", "data_1", "data_2")


def is_mat(begin: bytes) -> bool:
    """Return whether a file begins as one of MATLAB: text of version 5, five small numbers of version 4."""
    if begin.startswith(b"MATLAB 5.0"):
        return True
    if len(begin) < 20:
        return False
    kind, _, _, imaginary, length = struct.unpack_from("<5i", begin)
    digits = kind // 1000, kind // 100 % 10, kind // 10 % 10, kind % 10  # machine, 0, precision, form
    return kind >= 0 and digits[0] < 5 and digits[1] == 0 and digits[3] < 3 and imaginary in (0, 1) and 0 < length < 256


def read_mat(file: Path) -> tuple[dict[str, AnyArray], dict[str, float]]:
    """Return columns, and values that are constant, by name.  Raises DataError."""
    if file.stat().st_size > 8 * LARGEST:
        raise DataError(file, [f"larger than {8 * LARGEST >> 20} MB; save the series that a record needs as Parquet"])
    from gyrobench.exchange.mat_contents import TOO_LARGE  # of scipy.io

    reader = [sys.executable, "-P", str(Path(__file__).with_name("mat_contents.py")), str(file), str(MOST)]
    done = subprocess.run(reader, capture_output=True, check=False)
    if done.returncode == TOO_LARGE:
        raise DataError(file, [f"arrays of more than {MOST >> 20} MB; save the series that a record needs as Parquet"])
    if done.returncode != 0:
        said = done.stderr.decode(errors="replace").split("\n") if done.returncode == 1 else []
        why = next(filter(None, reversed(said)), "it ended the program that read it")
        raise DataError(file, [f"not a MATLAB file that can be read: {why}"])
    content = pickle.loads(done.stdout)
    if all(n in content for n in LAYOUT):
        return _trajectory(file, content)
    return _arrays(content), {}


def _arrays(content: Mapping[str, Any], prefix: str = "") -> dict[str, AnyArray]:
    """Return vectors by name, those in structs as "struct.field"."""
    columns: dict[str, AnyArray] = {}
    for name, value in content.items():
        if not isinstance(value, np.ndarray) or value.size == 0:
            continue
        if value.dtype.names and value.size == 1 and prefix.count(".") < 8:
            fields = {n: value[n].reshape(-1)[0] for n in value.dtype.names}
            columns |= _arrays(fields, f"{prefix}{name}.")
        elif value.dtype.kind in "biuf" and value.size == max(value.shape):
            columns[prefix + name] = value.reshape(-1)
    return columns


def _trajectory(file: Path, content: Mapping[str, Any]) -> tuple[dict[str, AnyArray], dict[str, float]]:
    def wrong(what: str) -> DataError:
        return DataError(file, [f"the trajectories of a Modelica tool, but {what}"])

    if any(np.ndim(content[n]) != 2 for n in LAYOUT):
        raise wrong(f"{', '.join(LAYOUT)} are not all matrices")
    form = "".join(str(c) for c in content["Aclass"][-1]).strip(" \0") if len(content["Aclass"]) else ""
    if form not in ("binTrans", "binNormal"):
        raise wrong(f"of the unknown form '{form[:20]}'")
    turned = form == "binTrans"
    texts, info, first, second = (content[n].T if turned else content[n] for n in LAYOUT[1:])
    names = ["".join(str(c) for c in row).strip(" \0") for row in texts]
    if info.shape[0] != len(names) or info.shape[1] < 2 or info.dtype.kind not in "iuf":
        raise wrong("dataInfo does not have a row for each name")
    columns: dict[str, AnyArray] = {}
    constants: dict[str, float] = {}
    for k, name in enumerate(names):
        table, signed = int(info[k, 0]), int(info[k, 1])
        data, at, sign = first if table == 1 else second, abs(signed) - 1, -1.0 if signed < 0 else 1.0
        if not (0 <= at < data.shape[1] and data.shape[0] > 0):
            raise wrong(f"there is no column {abs(signed)} for {name[:60]}")
        if table == 1:
            constants[name] = sign * float(data[0, at])
        else:
            columns[name] = data[:, at] if signed > 0 else -data[:, at]
    return columns, constants
