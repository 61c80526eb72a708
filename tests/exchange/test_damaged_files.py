"""Damaged files: archives whose directory can be read and a file in them cannot; arrays that end their reader."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path

import numpy as np
import pytest
from commanding import Command
from scipy.io import savemat

from gyrobench import files, reading
from gyrobench.bench import UsageError
from gyrobench.engine.session import Session
from gyrobench.exchange.mat_files import read_mat
from gyrobench.exchange.ssp_export import export_ssp
from gyrobench.exchange.ssp_import import read_ssp
from gyrobench.files import DamagedFmuError, OversizedArchiveError, check_size, unzip_fmu
from gyrobench.packaging import build
from gyrobench.packaging.compiler import PLATFORMS, this_platform
from gyrobench.record.csv_reader import DataError
from gyrobench.system.system import InvalidConfigurationError, load_system

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


@pytest.mark.long
def test_an_archive_of_a_system_with_damaged_data_is_refused(tmp_path: Path) -> None:
    export_ssp(load_system("open_loop_drift"), tmp_path / "system.ssp")
    with pytest.raises(InvalidConfigurationError, match="not an SSP archive: Error -3 while decompressing"):
        read_ssp(damage(tmp_path / "system.ssp", ".ssd"), 1e-3)


def bomb(path: Path, members: dict[str, bytes]) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return path


def test_archives_that_would_fill_the_disk_are_not_unzipped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    """1 MB of zeros, a thousand times the archive: beyond the ratio, which small ones may have; then each limit."""
    zeros, xml = bytes(1 << 20), b"<fmiModelDescription/>"
    fmu = bomb(tmp_path / "a.fmu", {"modelDescription.xml": xml, "resources/zeros": zeros})
    check_size(fmu)
    monkeypatch.setattr(files, "SMALL", 1 << 19)
    words = r"not unzipped: 1 MB when unzipped, [\d,]+ times its size; the limit is 100 times"
    code, _, err = command("run", "tumble_single_axis", "--part", f"gyro={fmu}", "--out", tmp_path / "run")
    assert code == 2 and re.search("slot gyro: .*a.fmu: " + words, err)
    with pytest.raises(OversizedArchiveError, match=words):
        unzip_fmu(fmu, tmp_path / "unzipped")
    assert not (tmp_path / "unzipped").exists()
    code, out, err = command("validate", fmu)
    assert code == 1 and re.search(words, out + err)
    with pytest.raises(InvalidConfigurationError, match=words):
        read_ssp(bomb(tmp_path / "a.ssp", {"SystemStructure.ssd": b"<a/>", "zeros": zeros}), 1e-3)
    with pytest.raises(OversizedArchiveError, match="3 files in the archive; the limit is 2"):
        monkeypatch.setattr(files, "MEMBERS", 2)
        check_size(bomb(tmp_path / "b.fmu", {n: b"" for n in "abc"}))
    with pytest.raises(OversizedArchiveError, match="1 MB when unzipped; the limit is 1 MB"):
        monkeypatch.setattr(files, "UNZIPPED", 1 << 20)
        check_size(bomb(tmp_path / "c.fmu", {"a": bytes((1 << 20) + 1)}))


def test_a_model_description_that_would_fill_the_memory_is_not_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Entities that grow, and one of many bytes; FMPy reads both."""
    from gyrobench.workflow.inputs import check_fmu_files

    entity = b'<!DOCTYPE a [<!ENTITY b "bbbb"><!ENTITY c "&b;&b;">]><fmiModelDescription>&c;</fmiModelDescription>'
    fmu = bomb(tmp_path / "a.fmu", {"modelDescription.xml": entity})
    with pytest.raises(UsageError, match=r"slot gyro: .*a\.fmu: .*XML with a document type"):
        check_fmu_files({"gyro": fmu})
    monkeypatch.setattr(reading, "LARGEST_XML", 1 << 20)
    fmu = bomb(tmp_path / "b.fmu", {"modelDescription.xml": b"<a>" + bytes(1 << 20) + b"</a>"})
    with pytest.raises(UsageError, match="XML of 1 MB; the limit is 1 MB"):
        check_fmu_files({"gyro": fmu})


@pytest.mark.long
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
