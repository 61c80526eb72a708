"""Tables of a record as Parquet: the numbers come back, and pandas, which takes 0.2 s to load, is left alone."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from gyrobench.record.record import read_table, write_table

LOADED = "import sys; from pathlib import Path; from gyrobench.record.record import read_table; {}; print(*sys.modules)"


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
