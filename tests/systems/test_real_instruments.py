"""Records of real instruments beside the figures of their makers; skipped where there are none beside the checkout."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from gyrobench.system.system import load_system
from gyrobench.workflow.instruments import find_instrument

DATA = Path(__file__).parents[3] / "shared" / "data"
PER_ROOT_HOUR = math.pi / 180.0 / 60.0


#: record -> sheet, sampling rate, and how many times N is by what folds from above half of that rate: of points, the
#: root of the noise band of the sensor (1.11 x 256 Hz for MPU6050, Butterworth) over it
RECORDS = {
    "adis16405_unit1": ("adis16405", 100.0, 1.0),  # its output was filtered to the sampling rate
    "mpu6050_static": ("mpu6050", 99.3, math.sqrt(1.11 * 256.0 / 49.65)),
}


@pytest.mark.parametrize("file", RECORDS)
def test_random_walk_of_a_real_unit_is_that_of_its_sheet(tmp_path: Path, file: str) -> None:
    """Gyro x of half an hour, or ten minutes: within 50 % of the typical figure, which is that of no one unit."""
    sheet, sampling, folded = RECORDS[file]
    source = DATA / f"{file}.parquet"
    if not source.is_file():
        pytest.skip("no folder ../shared/data with real records beside the checkout")
    rate = pq.read_table(source, columns=["gyro_x"]).slice(0, 180_000)
    pq.write_table(pa.table({"gyro_x [deg/s]": rate["gyro_x"]}), tmp_path / "x.parquet")
    system = load_system("drift_record")
    result = system.reduce(system.read_measured(tmp_path / "x.parquet", {"sampling": f"{sampling:g}Hz"}))
    n = next(c for c in result.coefficients if c.name == "N")
    density = find_instrument(sheet).density
    assert density is not None
    assert n.estimate == pytest.approx(folded * density / PER_ROOT_HOUR, rel=0.5)


def test_bias_of_a_real_unit_over_temperature(tmp_path: Path) -> None:
    """MPU6050, ten minutes over 0.5 K: its bias follows it by no more than its maker's 20 °/s over 125 K.

    0.16 °/s/K = 576 °/h/K; the slope of a fit of the means over ten seconds is within the interval, too.
    """
    source = DATA / "mpu6050_static.parquet"
    if not source.is_file():
        pytest.skip("no folder ../shared/data with real records beside the checkout")
    read = pq.read_table(source, columns=["gyro_x", "temperature"])
    columns = {"gyro_x [deg/s]": read["gyro_x"], "temperature [degC]": read["temperature"]}
    pq.write_table(pa.table(columns), tmp_path / "x.parquet")
    system = load_system("drift_record")
    result = system.reduce(system.read_measured(tmp_path / "x.parquet", {"sampling": "99.3Hz"}))
    (table,) = result.as_dict()["columns"][0]["tables"]["regression"]
    name, slope, _, low, high, unit, *_ = table["rows"][0]
    assert (name, unit) == ("temperature", "°/h per K") and -576.0 < low < slope < high < 576.0
    means = [read[n].to_numpy()[:65000].reshape(-1, 1000).mean(axis=1) for n in ("temperature", "gyro_x")]
    assert low < 3600.0 * np.polyfit(*means, 1)[0] < high
