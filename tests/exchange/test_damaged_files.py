"""Damaged files: archives whose directory can be read and a file in them cannot; arrays that end their reader."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from gyrobench.engine.session import Session
from gyrobench.exchange.mat_files import read_mat
from gyrobench.exchange.ssp_export import export_ssp
from gyrobench.exchange.ssp_import import read_ssp
from gyrobench.files import DamagedFmuError
from gyrobench.packaging import build
from gyrobench.packaging.compiler import PLATFORMS, this_platform
from gyrobench.record.csv_reader import DataError
from gyrobench.system.system import InvalidConfigurationError, load_system

Command = Callable[..., tuple[int, str, str]]
HEADER = 30  # bytes before the name of a file in its local header


def damage(path: Path, ending: str) -> Path:
    """Change bytes in the compressed data of the file with this ending; return the damaged copy."""
    content = bytearray(path.read_bytes())
    with zipfile.ZipFile(path) as archive:
        inside = next(i for i in archive.infolist() if i.filename.endswith(ending))
    begin = inside.header_offset + HEADER + len(inside.filename)
    for k in range(begin + 20, begin + min(100, inside.compress_size)):
        content[k] ^= 0x5A
    damaged = path.with_name(f"damaged{path.suffix}")
    damaged.write_bytes(content)
    return damaged


def test_an_fmu_with_a_damaged_library_is_refused(tmp_path: Path, command: Command) -> None:
    """Its model description, which is read before anything else, is as it was."""
    fmu = damage(build("floated_gyro", out=tmp_path), PLATFORMS[this_platform()][0])
    words = "damaged.fmu: cannot be unzipped, the file is damaged"
    with pytest.raises(DamagedFmuError, match=words):
        Session(load_system("tumble_single_axis"), {"gyro": str(fmu)})
    code, _, err = command("run", "tumble_single_axis", "--part", f"gyro={fmu}", "--out", tmp_path / "run")
    assert code == 2 and words in err and "Traceback" not in err


def test_an_archive_of_a_system_with_damaged_data_is_refused(tmp_path: Path) -> None:
    export_ssp(load_system("open_loop_drift"), tmp_path / "system.ssp")
    with pytest.raises(InvalidConfigurationError, match="not an SSP archive: Error -3 while decompressing"):
        read_ssp(damage(tmp_path / "system.ssp", ".ssd"), 1e-3)


def test_a_mat_file_that_ends_its_reader_is_refused(tmp_path: Path) -> None:
    """The class of an array changed: scipy's reader takes what is not there (signal 11) in its own process."""
    savemat(tmp_path / "a.mat", {"time": np.arange(4.0), "s": {"a": np.arange(4.0)}})
    content = bytearray((tmp_path / "a.mat").read_bytes())
    assert content[144] == 6  # double
    content[144] = 5  # an object
    (tmp_path / "b.mat").write_bytes(content)
    assert set(read_mat(tmp_path / "a.mat")[0]) == {"time", "s.a"}
    with pytest.raises(DataError, match="not a MATLAB file that can be read"):
        read_mat(tmp_path / "b.mat")
