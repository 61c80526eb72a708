"""Handling errors in measured records: named with both scatters, never passed; a clean record is not accused.

The counts over all templates: tests/benchmarks/handling.py.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commanding import Command
from test_tumble_measured import laboratory
from tumbling import NAME, SHORT

from gyrobench.bench import standard_folder
from gyrobench.engine.session import Session
from gyrobench.reduction.estimation import nuisances
from gyrobench.reduction.estimation.linear_fit import fit
from gyrobench.reduction.estimation.quantity import Quantity

LIMITS = '[coefficients."{}"]\nunit = "{}"\nmin = -1e6\nmax = 1e6\n'
DIAGNOSIS = "handling.diagnosis"


@pytest.fixture(scope="module")
def text() -> str:
    """A tumble of the default gyro, as a laboratory writes it; D_O = 0.1, D_S = -0.7 deg/h/g."""
    with Session(NAME) as session:
        record = session.run(SHORT, seed=7)
    return laboratory(record).replace("latitude = -33.9deg", "latitude = 45.75deg") + "# type_b = none\n"


def strict(
    command: Command, folder: Path, system: str, text: str, judged: tuple[str, str], *more: str
) -> tuple[int, dict[str, Any]]:
    """Exit code and result of ``reduce --strict`` with limits that the coefficient ``judged`` (name, unit) keeps."""
    (folder / "lab.csv").write_text(text, encoding="utf-8")
    (folder / "limits.toml").write_text(LIMITS.format(*judged), encoding="utf-8")
    given = ("--data", folder / "lab.csv", "--spec", folder / "limits.toml", "--out", folder / "out", "--force")
    code, _, err = command("reduce", system, *given, "--strict", *more)
    assert code in (0, 1), err
    return code, json.loads((folder / "out" / "result.json").read_text("utf-8"))


def exchanged(text: str, a: str, b: str) -> str:
    return text.replace(f"= {a}\n", "= @\n").replace(f"= {b}\n", f"= {a}\n").replace("= @\n", f"= {b}\n")


def scatters(warning: str) -> tuple[float, float]:
    found = re.search(r"residual scatter (\S+) °/h as labelled, (\S+) °/h with", warning)
    assert found, warning
    return float(found[1]), float(found[2])


@pytest.mark.long
def test_a_clean_record_passes(command: Command, text: str, tmp_path: Path) -> None:
    code, found = strict(command, tmp_path, NAME, text, ("D_S", "deg/h/g"))
    assert code == 0 and found["verdict"] == "pass" and not found["withheld"]
    assert not any("Handling" in w or "tilt" in w for w in found["warnings"])
    assert all(t["id"] != DIAGNOSIS for t in found["tables"])


@pytest.mark.parametrize("more", [(), ("--set", "tilt=yes"), ("--set", "nuisances=none")])
@pytest.mark.long
def test_exchanged_mounts(command: Command, text: str, tmp_path: Path, more: tuple[str, ...]) -> None:
    """D_O Y is of the wrong sign against the dwells: a step of 4 x 0.1 x sin(45.75 deg) = 0.29 deg/h between mounts,
    which a tilt of the input axis would make, too; so it is found when that is estimated, and not advised.
    """
    plain = ("--set", "nuisances=none", "--set", "tilt=no")
    clean = strict(command, tmp_path, NAME, text, ("D_S", "deg/h/g"), *plain)[1]
    code, found = strict(command, tmp_path, NAME, exchanged(text, "mount 1", "mount 2"), ("D_S", "deg/h/g"), *more)
    assert code == 1 and found["verdict"] == "inconclusive"
    first = found["warnings"][0]
    assert first.startswith("Handling error") and "mount 1 and mount 2 exchanged" in first
    labelled, undone = scatters(first)
    # the step between the two halves of the record; undone, the scatter of the record without the mistake, or a little
    # less by a mistake that cannot be told from it
    assert 0.09 < labelled < 0.2 and undone == pytest.approx(clean["residual_std"], rel=0.1)
    assert not any("tilt of the input axis" in w for w in found["warnings"])
    table = next(t for t in found["tables"] if t["id"] == DIAGNOSIS)
    assert table["rows"][0][0] == "as labelled" and len(table["rows"]) > 2
    assert "A handling error explains the residuals" in found["withheld"][-1]


@pytest.mark.long
def test_an_unknown_mistake_is_inconclusive(command: Command, text: str, tmp_path: Path) -> None:
    """The currents of mount 2 four times as large: no mistake that is tried, and no verdict."""
    *head, header, rest = text.partition("remark,")
    lines = (header + rest).splitlines()
    names = [n.split(" ")[0] for n in lines[0].split(",")]
    phase = re.search(r"# phase (\d) = mount 2", text)
    assert phase
    out = [lines[0]]
    for line in lines[1:]:
        cells = line.split(",")
        if not line.startswith("#") and cells[names.index("phase")] == phase[1]:
            cells[names.index("mean")] = repr(4.0 * float(cells[names.index("mean")]))
        out.append(",".join(cells))
    code, found = strict(command, tmp_path, NAME, head[0] + "\n".join(out) + "\n", ("D_S", "deg/h/g"))
    assert code == 1 and found["verdict"] == "inconclusive"
    assert any("contradict" in w for w in found["warnings"])
    assert not any(w.startswith("Handling error") for w in found["warnings"])


def test_a_refused_record_says_what_would_make_it_one(command: Command, text: str, tmp_path: Path) -> None:
    (tmp_path / "lab.csv").write_text(text.replace("angle_start [deg]", "angle_start [rad]").replace(
        "angle_end [deg]", "angle_end [rad]"), encoding="utf-8")  # fmt: skip
    code, _, err = command("reduce", NAME, "--data", tmp_path / "lab.csv", "--out", tmp_path / "out")
    assert code in (2, 3) and "the angles in degrees, not in rad: was that mistaken?" in " ".join(err.split())


@pytest.mark.long
def test_exchanged_currents_of_a_torquer(command: Command, tmp_path: Path) -> None:
    """Eight rows, no test of residuals: currents of neighbouring rows exchanged make K_n of twice and half the size."""
    table = (standard_folder() / "systems" / "torquer_scale_factor" / "book_table.csv").read_text("utf-8")
    table += "# type_b = none\n# arrangement = checked\n"
    code, found = strict(command, tmp_path, "torquer_scale_factor", table, ("K", "°/h/mA"))
    assert code == 0 and not any(w.startswith("Handling error") for w in found["warnings"])
    rows = [k for k, line in enumerate(table.splitlines()) if line[:1].isdigit()]
    lines = table.splitlines()
    a, b = lines[rows[3]].split(","), lines[rows[4]].split(",")
    a[0], b[0] = b[0], a[0]
    lines[rows[3]], lines[rows[4]] = ",".join(a), ",".join(b)
    code, found = strict(command, tmp_path, "torquer_scale_factor", "\n".join(lines) + "\n", ("K", "°/h/mA"))
    assert code == 1 and "the currents of rows 4 and 5 exchanged" in found["warnings"][0]


def test_a_reversed_current_in_a_dwell(command: Command, tmp_path: Path) -> None:
    """Thirty readings in one attitude, the leads exchanged from the 20th on: without a model of the test."""
    noise = np.random.default_rng(2).normal(size=30) * 1e-4
    mean = np.where(np.arange(30) < 19, 1.0, -1.0) * (0.6 + noise)
    rows = [f"{120 * k},{120 * k + 120},{v!r}" for k, v in enumerate(mean.tolist())]
    head = (
        "# latitude = 45.75deg\n# k = 17.2deg/h/mA\n# attitude = N E\n# type_b = none\nt_start [s],t_end [s],mean [mA]"
    )
    code, found = strict(command, tmp_path, "fixed_position", "\n".join([head, *rows, ""]), ("ω_d", "deg/h"))
    assert code == 1 and "of the opposite sign in rows 20 to 30" in found["warnings"][0]
    # k times the scatter of the noise, 17.2 x 1e-4 deg/h = 0.0017
    assert scatters(found["warnings"][0])[1] == pytest.approx(17.2 * float(np.std(noise, ddof=1)), rel=1e-2)


def test_start_and_end_of_the_angles_exchanged(command: Command, text: str, tmp_path: Path) -> None:
    """Windows that follow one another share an angle; the table cannot jump by two of them and turn back."""
    swapped = text.replace("angle_start", "@").replace("angle_end", "angle_start").replace("@", "angle_end")
    (tmp_path / "lab.csv").write_text(swapped, encoding="utf-8")
    code, _, err = command("reduce", NAME, "--data", tmp_path / "lab.csv", "--out", tmp_path / "out")
    assert code in (2, 3) and "columns angle_start and angle_end are exchanged" in " ".join(err.split())


def test_a_misalignment_that_no_setup_has() -> None:
    """A fit that takes a misplaced column for a misalignment of 40 degrees says so; one of half a degree may be."""
    rng = np.random.default_rng(5)
    n, X = 60, rng.normal(size=(60, 2))
    tilted = nuisances.Candidate.of("ε", "misalignment", "arcsec", X[:, 1])
    y = X @ [1.0, np.radians(40.0)] + 1e-3 * rng.normal(size=n)
    t = np.arange(n, dtype=float)
    found = fit([Quantity("a", "a", "1", 1.0)], X[:, :1], y, t, t + 1.0, [], "y", "1", 1.0, candidates=[tilted])
    (reason,) = found.implausible_nuisances()
    # 40 x 3600 = 144000; limit 1 degree
    assert "ε = 144000 ″" in reason.text and "3600 ″" in reason.text and reason.blocks == ("pass", "fail")
    small = X @ [1.0, np.radians(0.5)] + 1e-3 * rng.normal(size=n)
    found = fit([Quantity("a", "a", "1", 1.0)], X[:, :1], small, t, t + 1.0, [], "y", "1", 1.0, candidates=[tilted])
    assert found.implausible_nuisances() == [] and found.nuisance_sentences()


def test_coefficients_of_the_size_of_the_earth_rate(command: Command, tmp_path: Path) -> None:
    """Input axis up at 45.75 deg, drift 0.1 deg/h: rate 15.041 sin(45.75 deg) = 10.774; read with the latitude of the
    other sign, the drift is 0.1 + 2 x 10.774 = 21.65 deg/h (sign as k i = omega - drift).
    """
    up = 15.041067 * np.sin(np.radians(45.75))
    noise = np.random.default_rng(2).normal(size=30) * 1e-4
    rows = [f"{120 * k},{120 * k + 120},{v!r}" for k, v in enumerate((noise + (up - 0.1) / 17.2).tolist())]
    for latitude, warned in (("45.75", False), ("-45.75", True)):
        head = f"# latitude = {latitude}deg\n# k = 17.2deg/h/mA\n# attitude = U E\n# type_b = none\n"
        text = "\n".join([head + "t_start [s],t_end [s],mean [mA]", *rows, ""])
        _, found = strict(command, tmp_path, "fixed_position", text, ("ω_d", "deg/h"))
        assert any("twice the vertical component" in w for w in found["warnings"]) == warned, found["warnings"]


MISTAKEN: dict[str, Callable[[str], str]] = {
    "mounts and dwells exchanged": lambda t: exchanged(exchanged(t, "mount 1", "mount 2"), "static 3", "static 4"),
    "latitude of another city": lambda t: t.replace("latitude = 45.75deg", "latitude = 40.75deg"),
    "k off by 2 %": lambda t: t.replace("k = 17.2 deg", "k = 17.544 deg"),
    "nothing": lambda t: t,
}


@pytest.mark.parametrize("mistake", MISTAKEN)
@pytest.mark.long
def test_what_no_residual_shows_is_asked_for(command: Command, text: str, tmp_path: Path, mistake: str) -> None:
    """Each is fitted as well as the truth (D_S off by hundreds of u, D_I by 0.98 of 15 deg/h cos and sin ...): a record
    that does not state that they were looked for passes nothing, and names them; one that does passes.
    """
    make, judged = MISTAKEN[mistake], ("D_S", "deg/h/g")
    unstated = make(text.replace("# arrangement = checked\n", ""))
    assert "arrangement" not in unstated
    code, found = strict(command, tmp_path, NAME, unstated, judged)
    assert code == 1 and found["verdict"] == "inconclusive"
    (asked,) = [r for r in found["reasons"] if r["id"] == "arrangement.unstated"]
    for words in (
        "exchanged (D_S",
        "the latitude wrong by 1°",
        "the scale factor k wrong by 2 %",
        "arrangement = checked",
    ):
        assert words in asked["text"], asked["text"]
    assert "D_S" in asked["names"]
    code, found = strict(command, tmp_path, NAME, make(text), judged)
    assert (code, found["verdict"]) == (0, "pass")
    assert not [r for r in found["reasons"] if r["id"] == "arrangement.unstated"]


@pytest.mark.long
def test_a_stated_uncertainty_is_not_asked_for(command: Command, text: str, tmp_path: Path) -> None:
    bare = text.replace("# arrangement = checked\n", "").replace("# type_b = none\n", "")
    sizes = ("u_scale_factor=1e-4", "u_mount=20arcsec", "u_remount=1e-4deg/h")
    more = [word for size in sizes for word in ("--set", size)]
    _, found = strict(command, tmp_path, NAME, bare, ("D_S", "deg/h/g"), *more)
    (asked,) = [r["text"] for r in found["reasons"] if r["id"] == "arrangement.unstated"]
    assert "scale factor" not in asked and "zero of the angles" not in asked and "latitude" in asked


def test_a_word_that_is_no_statement_is_refused(command: Command, text: str, tmp_path: Path) -> None:
    (tmp_path / "lab.csv").write_text(text.replace("arrangement = checked", "arrangement = perhaps"), "utf-8")
    code, _, err = command("reduce", NAME, "--data", tmp_path / "lab.csv", "--out", tmp_path / "out")
    assert code == 2 and "arrangement = perhaps: 'checked' or nothing is expected" in err


@pytest.mark.long
def test_data_of_one_dwell_in_the_other_are_named(command: Command, text: str, tmp_path: Path) -> None:
    """Readings of static 3 copied into static 4, bit for bit; the same with one digit changed is no copy."""
    head, _, rest = text.partition("remark,")
    rows = [line.split(",") for line in ("remark," + rest).splitlines() if line and line[0] != "#"]
    names = [n.split(" ")[0] for n in rows[0]]
    place, mean = names.index("phase"), names.index("mean")
    number = {face: n for n, face in re.findall(r"# phase (\d) = (static \d)", text)}
    one, two = ([r for r in rows[1:] if r[place] == number[f"static {k}"]] for k in (3, 4))
    for a, b in zip(one, two, strict=True):
        b[mean] = a[mean]
    for wrong in (True, False):
        if not wrong:
            two[1][mean] = repr(float(two[1][mean]) * (1.0 + 1e-9))
        lines = head + "\n".join(",".join(r) for r in rows) + "\n# type_b = none\n"
        code, found = strict(command, tmp_path, NAME, lines, ("D_S", "deg/h/g"))
        named = [r for r in found["reasons"] if r["id"] == "record.identical_phases"]
        assert bool(named) == wrong
        if wrong:
            assert code == 1 and found["verdict"] == "inconclusive"
            pair = " and ".join(sorted((number["static 3"], number["static 4"])))
            assert f"Phases {pair} hold the same readings" in named[0]["text"]
