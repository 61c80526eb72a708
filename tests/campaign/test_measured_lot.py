"""A lot of measured files, five of them wrong, from the files to the site with one command."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from commanding import Command
from measured_lot import instrument, write_lot, wrong

COUNT = 12


@pytest.mark.long
def test_lot_with_mistakes_ends_in_a_site_that_names_them(command: Command, tmp_path: Path) -> None:
    write_lot(tmp_path / "lot", COUNT)
    bad = {instrument(k): what for k, what in wrong(COUNT).items()}
    out = tmp_path / "out"
    code, text, err = command(
        "sweep", "tumble_single_axis", "--data", f"{tmp_path}/lot/*.csv", "--spec", "floated_gyro", "--workers", 1,
        "--keep", "none", "--site", "--out", out,
    )  # fmt: skip
    assert code == 0, err
    assert f"5 of {COUNT} measured files need attention: {', '.join(bad)}." in text
    assert "The other 7: 7 pass." in text
    listed = {
        i["instrument"]: i for i in json.loads((out / "site" / "analysis.json").read_text())["lot"]["instruments"]
    }
    why = {bad[name]: " ".join(listed[name]["why"]) for name in bad}
    assert "outlier" in why["current in another unit"]
    assert "mount 1 and mount 2 exchanged" in why["exchanged mounts"]
    assert "angles in rad, not in degrees" in why["angle in another unit"]
    assert "5 cells, the header has 6" in why["torn"]
    assert "'mean': no unit" in why["no unit"]
