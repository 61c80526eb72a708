"""The torquer table of Hu 1981 through the command: 17.171 deg/h/mA and the linearity column."""

from __future__ import annotations

import importlib
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commanding import Command

from gyrobench.bench import Bench
from gyrobench.reduction.estimation.verdict import conclude
from gyrobench.system.system import load_system
from gyrobench.units import DPH

NAME = "torquer_scale_factor"


def test_printed_table(command: Command, tmp_path: Path) -> None:
    """[LIN-TABLE, E49]: K = 17.1706, printed 17.171; linearity against 17.171, the 5 mA value with its true sign."""
    data = Bench.find().system_folder(NAME) / "book_table.csv"
    code, out, err = command("reduce", NAME, "--data", data, "--out", tmp_path)
    assert code == 0, err
    assert "17.17" in out
    result = json.loads((tmp_path / "result.json").read_text("utf-8"))
    (K,) = [c for c in result["coefficients"] if c["name"] == "K"]
    assert K["unit"] == "°/h/mA"
    # mean of 17.184 17.169 17.166 17.160 17.172 17.173 17.170 17.171: 17 + (184+169+166+160+172+173+170+171)/8000
    assert K["estimate"] == pytest.approx(17.0 + 1.365 / 8.0, rel=1e-12)
    assert abs(K["estimate"] - 17.171) < 5e-4
    assert not result["simulated"]
    column = [
        [row[k] for row in t["rows"]]
        for t in result["tables"] for k, name in enumerate(t["columns"]) if "17.171" in name or "linearity" in name
    ]  # fmt: skip
    printed = [0.076, -0.012, -0.029, -0.064, 0.006, 0.012, -0.006, 0.0]
    assert any(_numbers(c) == pytest.approx(printed, abs=6e-4) for c in column), column


def _numbers(cells: list[object]) -> list[float]:
    return [float(str(c).replace("−", "-").replace("+", "").replace("%", "")) for c in cells]


def test_template_and_refusals(command: Command, tmp_path: Path) -> None:
    code, template, _ = command("reduce", NAME, "--template")
    assert code == 0
    file = tmp_path / "lab.csv"
    for rows, words in (
        ("", ["no rows"]),
        ("1,17.2,17.1,10,10\n2,34.4,34.2,10,20\n3,51.6,51.3,10,10\n", ["range"]),
        ("0,17.2,17.1,10,10\n2,34.4,34.2,10,10\n3,51.6,51.3,10,10\n", ["current"]),
        ("1,17.2,17.1,10,10\n", ["current"]),
        ("1,17.2,nan,10,10\n2,34.4,34.2,10,10\n3,51.6,51.3,10,10\n", ["rate_minus", "not a finite number"]),
    ):
        file.write_text(template + rows, encoding="utf-8")
        code, out, err = command("reduce", NAME, "--data", file, "--out", tmp_path / "out")
        assert code == 2 and out == "" and "Traceback" not in err, err
        for word in words:
            assert word in err, err
    file.write_text(template.replace("rate_minus [deg/h],", "") + "1,17.2,10,10\n", encoding="utf-8")
    code, _, err = command("reduce", NAME, "--data", file)
    assert code == 2 and "column 'rate_minus [rad/s]' is missing" in err


def test_it_is_listed(command: Command) -> None:
    code, out, _ = command("list")
    assert code == 0 and NAME in out


def test_printed_table_says_where_it_comes_from() -> None:
    head = (Bench.find().system_folder(NAME) / "book_table.csv").read_text("utf-8")
    assert "Hu 1981, table after eq. A3-6" in head and "K_n" in head


@pytest.mark.parametrize(
    ("column", "row", "factor", "words"),
    [
        # a row at 1000 times the others' current determines the cubic term alone: no residual is left
        (0, 5, 1e3, "Row 5 is mistaken"),
        # 17.17 i and twice that: half the difference is -17.17 i/2 = -1/3 of the mean of both, 1.5 x 17.17 i
        (2, 0, 2.0, "(K₊ − K₋)/(K₊ + K₋) = -33.3 %"),
        # 1 % in one of eight rows whose others depart by 0.03 %
        (1, 3, 1.02, "Row 3 contradicts the others"),
    ],
)
@pytest.mark.long
def test_mistaken_rows_and_senses(
    command: Command, tmp_path: Path, column: int, row: int, factor: float, words: str
) -> None:
    """A table with a mistake is inconclusive, whatever its few residuals say; row 0: all rows."""
    lines = (Bench.find().system_folder(NAME) / "book_table.csv").read_text("utf-8").splitlines()
    numbers = [k for k, line in enumerate(lines) if line[:1].isdigit()]
    for k in numbers if row == 0 else [numbers[row - 1]]:
        cells = lines[k].split(",")
        cells[column] = repr(float(cells[column]) * factor)
        lines[k] = ",".join(cells)
    (tmp_path / "lab.csv").write_text("\n".join([*lines, "# type_b = none", ""]), encoding="utf-8")
    (tmp_path / "limits.toml").write_text('[coefficients.K]\nunit = "°/h/mA"\nmin = -1e9\nmax = 1e9\n', "utf-8")
    given = ("--data", tmp_path / "lab.csv", "--spec", tmp_path / "limits.toml", "--out", tmp_path / "out")
    code, _, err = command("reduce", NAME, *given, "--strict")
    result = json.loads((tmp_path / "out" / "result.json").read_text("utf-8"))
    assert code == 1 and result["verdict"] == "inconclusive", err
    assert words in " ".join(result["withheld"]), result["withheld"]


def stepped(rng: np.random.Generator, step: float, marks: float) -> Any:
    """Return the result of a table as Hu 1981 takes it: r = K i (1 + marks ξ/Θ) ± drift, K = 17.2 °/h/mA, drift 0.05
    °/h, ranges of 10° and 100°; the rates of the positive sense over 10° are read too large by ``step``.
    """
    i, theta = np.array([1.0, 5.0, 10.0, 20.0, 40.0, 60.0, 80.0, 100.0]), np.repeat([10.0, 100.0], 4)
    plus, minus = (17.2 * i * (1.0 + marks * rng.normal(size=8) / theta) + s * 0.05 for s in (1.0, -1.0))
    plus = plus * np.where(theta == 10.0, 1.0 + step, 1.0)
    rows = {"current": i * 1e-3, "rate_plus": plus * DPH, "rate_minus": minus * DPH}
    rows |= dict.fromkeys(("range_plus", "range_minus"), np.radians(theta))
    reduction = importlib.import_module(".reduction", type(load_system(NAME)).__module__)
    return conclude(reduction.Reduction.reduce(rows), None, {"K": (17.1, 17.3)})


def test_a_gain_that_changes_with_the_range_is_named_and_in_u() -> None:
    """3e-4 of one sense are 1.5e-4 of K_n in half of the rows, 7.5e-5 of K: 1.29e-3 °/h/mA, beside marks of 1e-6."""
    for seed in range(12):
        result = stepped(np.random.default_rng(seed), 3e-4, 1e-4)
        K, least = result["K"], result["K_LS"]
        assert K.estimate - 17.2 == pytest.approx(0.75e-4 * 17.2, rel=0.1)
        # half of 1.5e-4 K is left open, whichever range is right
        assert K.u == pytest.approx(0.75e-4 * 17.2, rel=0.1)
        assert K.interval[0] < 17.2 < K.interval[1] and least.interval[0] < 17.2 < least.interval[1]
        assert max(K.interval[0], least.interval[0]) < min(K.interval[1], least.interval[1])
        assert result.verdict == "inconclusive"
        (reason,) = [r for r in result.reasons if r.id == "ranges.contradict"]
        assert "10° and 100° contradict" in reason.text and "differ by 0.0001" in reason.text
        assert "torquer.range_step" in {b.id for b in result.budget}


@pytest.mark.long
def test_tables_without_a_step_keep_their_intervals() -> None:
    """Of 300 (1,000: K 0.946, K_LS 0.958, K_1 0.950, drift 0.945) 0.95 hold the truth, and 0.01 are doubted."""
    truth = {"K": 17.2, "K_LS": 17.2, "K_1": 17.2, "drift": 0.05}
    results = [stepped(np.random.default_rng(seed), 0.0, 1e-3) for seed in range(300)]
    for name, value in truth.items():
        share = np.mean([r[name].interval[0] <= value <= r[name].interval[1] for r in results])
        assert abs(share - 0.95) < 3.0 * math.sqrt(0.95 * 0.05 / 300), (name, share)
    assert np.mean([r.verdict == "pass" for r in results]) > 0.96
