"""Tables of a record as Parquet: the numbers come back, and pandas, which takes 0.2 s to load, is left alone."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from gyrobench.record.record import ColumnsOnRequest, Record, read_table, write_table
from gyrobench.record.run_document import RecordError

LOADED = "import sys; from pathlib import Path; from gyrobench.record.record import read_table; {}; print(*sys.modules)"


@pytest.mark.long
def test_columns_come_back_without_pandas(tmp_path: Path) -> None:
    columns = {"phase": np.array([1, 2, 2]), "mean": np.array([0.1, np.nan, -3e-300]), "flagged": np.array([0, 1, 0])}
    assert write_table(tmp_path / "record", columns).suffix == ".parquet"
    found = read_table(tmp_path / "record")
    assert found is not None and list(found) == list(columns)
    for name, column in columns.items():
        assert found[name].dtype == column.dtype and found[name].flags.writeable
        np.testing.assert_array_equal(found[name], column)
    code = LOADED.format(f"read_table(Path({str(tmp_path / 'record')!r}))")
    loaded = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout.split()
    assert "pyarrow" in loaded and "pandas" not in loaded


def test_files_of_other_programs(tmp_path: Path) -> None:
    """Several row groups, missing values, texts and truth values: as Arrow has them."""
    table = pa.table({
        "x": pa.chunked_array([[1.0, 2.0], [3.0]]), "gap": [1.0, None, 3.0], "name": ["a", "b", "c"],
        "on": [True, False, True], "none": pa.array([None, None, None], pa.int32()),
    })  # fmt: skip
    pq.write_table(table, tmp_path / "record.parquet", row_group_size=2)
    found = read_table(tmp_path / "record")
    assert found is not None and found["x"].tolist() == [1.0, 2.0, 3.0]
    np.testing.assert_array_equal(found["gap"], [1.0, np.nan, 3.0])
    assert found["name"].tolist() == ["a", "b", "c"] and found["on"].tolist() == [True, False, True]
    assert np.isnan(found["none"]).all()
    pq.write_table(table.slice(0, 0), tmp_path / "record.parquet")
    assert {len(v) for v in (read_table(tmp_path / "record") or {}).values()} == {0}


def test_channels_are_read_when_they_are_asked_for(tmp_path: Path) -> None:
    """The same numbers, whatever way they are asked for; a changed table is refused all the same."""
    channels = {"time": np.arange(1000.0), "a.x": np.linspace(0.0, 1.0, 1000), "a.y": np.full(1000, np.nan)}
    Record({"mean": np.array([1.0])}, channels).save(tmp_path)
    record = Record.load(tmp_path, on_request=True)
    held = record.channels
    assert isinstance(held, ColumnsOnRequest) and list(held) == list(channels) and held.read == {}
    np.testing.assert_array_equal(held["a.x"], channels["a.x"])
    assert list(held.read) == ["a.x"]
    assert record.same_data(Record.load(tmp_path)) and {*dict(held)} == {*channels}
    assert held.get("b") is None and "b" not in held
    (tmp_path / "channels.parquet").write_bytes((tmp_path / "channels.parquet").read_bytes() + b"x")
    with pytest.raises(RecordError, match="changed after it was saved"):
        Record.load(tmp_path, on_request=True)
