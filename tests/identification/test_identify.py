"""Identification of loops whose truth is known, by models of their own (tests/support/own_loops.py, scipy alone)."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from own_loops import PERIOD, PLACES, UNITS, H, margins_of, odd_multisine, random_platform
from scipy import optimize, signal

import gyrobench as gb
from gyrobench.identification.identification_page import page
from gyrobench.identification.identify_loop import _share_at_ends, identify_record
from gyrobench.identification.loop_doubts import level_end
from gyrobench.identification.loop_record import LoopRecord, read_loop
from gyrobench.identification.missing_blocks import missing_blocks
from gyrobench.identification.ratios import MeasuredResponse


def noisy(seed: int, at: str, periods: int = 8, noise: float = 0.1) -> tuple:
    """Return a random platform and its record with noise of the sensor and a disturbing torque."""
    rng = np.random.default_rng(seed)
    loop = random_platform(rng)
    r = np.tile(odd_multisine(PERIOD, rng, 1.0, 150.0), periods)
    u, y = loop.run(r, at, np.zeros(r.size), np.zeros(r.size))
    torque, sensor = (noise * x.std() * rng.standard_normal(r.size) for x in (u, y))
    return loop, LoopRecord("own", H, r, *loop.run(r, at, torque, sensor), at, UNITS)


@pytest.fixture(scope="module")
def counted() -> list[tuple]:
    """Return a dozen of random platforms, the three places of excitation in turn, with what was identified."""
    cases = []
    for seed in range(14):
        loop, record = noisy(seed, PLACES[seed % 3])
        if loop.stable() and margins_of(loop, 1.0, 150.0)["peak S"] < 4.0:
            cases.append((loop, identify_record(record)))
    return cases


# ---------------------------------------------------------------------------------------------- truth
def continuous_loop() -> tuple[np.ndarray, np.ndarray, dict[str, float]]:
    """Return numerator and denominator of L in s, and its margins by root finding.

    P = 1/(J s2 + c s) times a mode of 60 Hz, C = K (1 + w_i/s)(1 + s/w_1)/(1 + s/w_2)
    """
    w0 = 2.0 * np.pi * 60.0
    num = np.polymul([1.2, 2 * 0.05 * w0, w0**2], np.polymul([40.0, 40.0 * 6.0], [1.0 / 40.0, 1.0]))
    den = np.polymul(
        np.polymul([0.05, 0.2, 0.0], [1.0, 2 * 0.05 * w0, w0**2]), np.polymul([1.0, 0.0], [1.0 / 400.0, 1.0])
    )

    def L(f: float) -> complex:
        return complex(np.polyval(num, 2j * np.pi * f) / np.polyval(den, 2j * np.pi * f))

    grid = np.geomspace(0.5, 100.0, 20000)
    size = np.array([abs(L(f)) for f in grid])
    crossed = [optimize.brentq(lambda f: abs(L(f)) - 1.0, grid[k], grid[k + 1])
               for k in np.flatnonzero((size[1:] > 1.0) != (size[:-1] > 1.0))]  # fmt: skip
    phase = min((float(np.angle(-L(f))) for f in crossed), key=abs)
    imag = np.array([L(f).imag for f in grid])
    turned = [optimize.brentq(lambda f: L(f).imag, grid[k], grid[k + 1])
              for k in np.flatnonzero((imag[1:] > 0.0) != (imag[:-1] > 0.0))]  # fmt: skip
    gains = [1.0 / abs(L(f)) for f in turned if L(f).real < 0.0]
    S = np.array([1.0 / (1.0 + L(f)) for f in grid])
    found = {"phase margin": phase, "disk margin": 1.0 / np.abs(S - 0.5).max(), "peak S": np.abs(S).max(),
             "peak T": np.abs(1.0 - S).max()}  # fmt: skip
    if up := [g for g in gains if g > 1.0]:
        found["gain margin"] = min(up)
    if down := [g for g in gains if g < 1.0]:
        found["gain-reduction margin"] = max(down)
    return num, den, found


@pytest.mark.long
def test_margins_of_a_continuous_loop() -> None:
    """Margins within 0.2 dB and 1 degree: simulated by scipy.signal.lsim, 10 kHz, r added to the plant's input."""
    num, den, truth = continuous_loop()
    rng = np.random.default_rng(1)
    r = np.tile(odd_multisine(PERIOD, rng, 0.5, 100.0), 5)
    fine = np.interp(np.arange(10 * r.size) / 10.0, np.arange(r.size), r)
    spectrum = np.fft.rfft(odd_multisine(PERIOD, np.random.default_rng(1), 0.5, 100.0))
    wide = np.zeros(5 * PERIOD + 1, complex)
    wide[: spectrum.size] = spectrum
    fine = np.tile(np.fft.irfft(wide, 10 * PERIOD) * 10.0, 5)  # the same lines, between the samples too
    _, u, _ = signal.lsim((den, np.polyadd(den, num)), fine, np.arange(fine.size) * H / 10.0)
    r, u = fine[::10], u[::10]
    y = np.cumsum(u) * H  # of no meaning here
    found = identify_record(LoopRecord("continuous", H, r, u, y, "plant input", UNITS))
    assert len(truth) >= 4
    for name, value in truth.items():
        m = found[name]
        if m.unit == "rad":
            assert np.degrees(abs(m.value - value)) < 1.0, name
        else:
            assert abs(20.0 * np.log10(m.value / value)) < 0.2, name


@pytest.mark.long
def test_intervals_hold_the_truth(counted: list[tuple]) -> None:
    """Some thousand points of L, S, T and P: 0.93 to 0.97 of the intervals of gain and phase; 10 platforms' margins."""
    held = dict.fromkeys("LSTP", 0)
    count = dict.fromkeys("LSTP", 0)
    margins = []
    for loop, found in counted:
        L, P = loop.responses(found.f)
        for name, truth in {"L": L, "S": 1.0 / (1.0 + L), "T": L / (1.0 + L), "P": P}.items():
            g = found.responses[name]
            good = g.determined & (g.u < 0.5)
            (low, high), (below, above) = g.gain(), g.phase()
            turn = np.angle(truth / g.value)
            held[name] += int(np.sum(((low <= np.abs(truth)) & (np.abs(truth) <= high))[good]))
            held[name] += int(np.sum(((below <= turn) & (turn <= above))[good]))
            count[name] += 2 * int(good.sum())
        truth = margins_of(loop, found.f[0], found.f[-1])
        margins += [truth[m.name] in m for m in found.margins if m.name in truth]
    assert len(counted) > 8
    for name in held:
        assert count[name] > 3000 and 0.93 < held[name] / count[name] < 0.97, name
    assert len(margins) > 50 and np.mean(margins) > 0.88


@pytest.mark.parametrize("kind", ["chirp", "random"])
def test_other_excitations(kind: str) -> None:
    rng = np.random.default_rng(5)
    loop = random_platform(np.random.default_rng(3))
    n = 30000
    r = signal.chirp(np.arange(n) * H, 0.5, n * H, 150.0, "logarithmic") if kind == "chirp" else rng.standard_normal(n)
    u, y = loop.run(r, "reference", np.zeros(n), np.zeros(n))
    u, y = loop.run(r, "reference", 0.1 * u.std() * rng.standard_normal(n), 0.1 * y.std() * rng.standard_normal(n))
    found = identify_record(LoopRecord("own", H, r, u, y, "reference", UNITS))
    assert found.period == 0.0 and found.linear is None
    L = loop.responses(found.f)[0]
    g = found.responses["L"]
    good = g.determined & (found.f < 120.0)
    low, high = g.gain()
    assert good.sum() > 40 and 0.88 < np.mean(((low <= np.abs(L)) & (np.abs(L) <= high))[good]) <= 1.0
    assert found["phase margin"].value == pytest.approx(margins_of(loop, 1.0, 120.0)["phase margin"], abs=0.05)


@pytest.mark.long
def test_dry_friction_is_seen_and_a_linear_loop_is_linear(counted: list[tuple]) -> None:
    """A cubic of the plant's input: lines left out hold what is not noise, and the intervals are wider."""
    assert all(found.linear for _, found in counted)
    loop, record = noisy(3, "plant input", noise=0.01)
    u = record.u - 0.05 * record.u**3 / record.u.std() ** 2
    bent = identify_record(LoopRecord("own", H, record.r, u, record.y, record.at, UNITS))
    straight = identify_record(record)
    assert straight.linear and bent.linear is False
    odd = next(d for d in bent.distortions if d.kind == "odd")
    assert odd.significant and odd.level > 0.01
    assert any(n.startswith("nonlinear: ") and "best linear approximation" in n for n in bent.notes)
    assert np.median(bent.responses["S"].u) > 3.0 * np.median(straight.responses["S"].u)
    assert loop.stable()


# --------------------------------------------------------------------------------------------- files
@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a file of 24 s with an excitation at the plant's input, the output in deg/s, time in ms."""
    _, record = noisy(3, "plant input", periods=6)
    path = tmp_path_factory.mktemp("loop") / "loop.csv"
    table = np.column_stack([1e3 * H * np.arange(record.r.size), record.r, record.u, np.degrees(record.y)])
    head = "# instrument = gimbal 4\ntime [ms],excitation [N.m],input [N.m],output [deg/s]"
    np.savetxt(path, table, fmt="%.9g", delimiter=",", header=head, comments="")
    return path


@pytest.mark.long
def test_a_file_from_python_and_its_page(file: Path, tmp_path: Path) -> None:
    found = gb.identify(file, band="1Hz..140Hz")
    assert found.period == pytest.approx(4.0) and found.record.at == "plant input"
    unit, factor = found.plant_unit
    assert unit == "°/s/(N·m)" and factor == pytest.approx(np.degrees(1.0))
    written = found.write(tmp_path)
    assert {p.name for p in written.values()} == {f"identification.{k}" for k in ("json", "html", "pdf")}
    data = json.loads(written["json"].read_text(encoding="utf-8"))
    assert [m["name"] for m in data["margins"]] == [m.name for m in found.margins]
    html = written["html"].read_text(encoding="utf-8")
    assert all(m.name in html for m in found.margins) and "mathdefault" not in html
    assert not re.search(r"\bnan\b|\binf\b", re.sub(r"<svg.*?</svg>", "", html, flags=re.S))
    assert [p.key for p in page(found).pictures] == [
        "nichols", "nyquist", "open-loop", "sensitivities", "plant", "distortion"
    ]  # fmt: skip
    with pytest.raises(KeyError, match="there are: "):
        found["beauty"]


def changed(file: Path, to: Path, **columns) -> Path:
    """Return a copy with other columns: name [unit] -> values, or None to leave one out; rows: how many."""
    lines = file.read_text().splitlines()
    head = lines[1].split(",")
    data = np.loadtxt(lines[2:], delimiter=",")
    table = dict(zip(head, data.T, strict=True))
    table.update({k: v for k, v in columns.items() if k not in ("rows", "comment")})
    kept = {k: v for k, v in table.items() if v is not None}
    path = to / "changed.csv"
    head = columns.get("comment", "") + ",".join(kept)
    values = np.column_stack(list(kept.values()))[: columns.get("rows")]
    np.savetxt(path, values, fmt="%.9g", delimiter=",", header=head,
               comments="")  # fmt: skip
    return path


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            {"output [deg/s]": None},
            r"column 'output \[unit\]' is missing .*columns of the file: time \[ms\], excitation",
        ),
        ({"input [N.m]": None, "input": 1}, "column 'input': no unit"),
        ({"input [N.m]": None, "input [beauty]": 1}, "column 'input': .*beauty"),
        ({"excitation [N.m]": None, "excitation [V]": 1}, r"where the excitation enters is not stated.*neither"),
        ({"comment": "# excitation enters at = output\n"}, "excitation enters at = output: one of plant input, ref"),
        ({"comment": "# excitation enters at = reference\n"}, "do not add"),
        ({"comment": "# perod = 4s\n"}, "'perod' is not known; did you mean 'period'"),
        ({"comment": "# period = 4.0001s\n"}, "not a whole number: generator and recorder need one clock"),
        ({"comment": "# period = 12s\n"}, "too short: 2 periods"),
        ({"comment": "# period = 9s\n"}, "repeats every 4 s .* stated is 9 s: the period is another"),
        ({"comment": "# period = 3.96s\n"}, "4000 samples; .* stated is 3.96 s: the times are off by 1 %"),
        ({"rows": 100}, "100 samples; at least 200 are needed"),
        ({"rows": 600}, "have a response above the noise"),
        ({"excitation [N.m]": 0}, "column 'excitation' does not change"),
    ],
)
def test_what_is_wrong_is_said(file: Path, tmp_path: Path, change: dict, words: str) -> None:
    count = len(file.read_text().splitlines()) - 2
    filled = {
        k: np.full(count, float(v)) if isinstance(v, int) and k not in ("rows",) else v for k, v in change.items()
    }
    with pytest.raises(gb.GyrobenchError, match=re.compile(words, re.S)):
        gb.identify(changed(file, tmp_path, **filled))


def test_gaps_and_controllers(file: Path, tmp_path: Path) -> None:
    record = read_loop(file)
    t = 1e3 * H * np.arange(record.r.size)
    late = np.where(np.arange(t.size) > 5000, t + 3.0, t)
    with pytest.raises(
        gb.GyrobenchError, match=r"time steps are not even: 0\.001 s is the usual one, 0\.004 s the longest"
    ):
        gb.identify(changed(file, tmp_path, **{"time [ms]": late}))
    other = changed(file, tmp_path, **{"input [N.m]": None, "controller [N.m]": record.u - record.r})
    assert read_loop(other).u == pytest.approx(record.u, abs=1e-6)
    two = changed(file, tmp_path, rows=9000)
    found = gb.identify(two)
    assert found.period == 0.0 and any(n.startswith("2.2 periods are in the record") for n in found.notes)


# ---------------------------------------------------------------------------------------------- a record of two loops
def own(periods: int = 8, stiffer: float = 1.0, seed: int = 3) -> LoopRecord:
    """Inertia, friction, PI controller of 8 Hz, a step late; from half of the record on with another inertia."""
    rng, h = np.random.default_rng(seed), 1e-3
    r = np.tile(odd_multisine(PERIOD, rng, 1.0, 150.0), periods)
    u, y = np.zeros(r.size), np.zeros(r.size)
    rate = integral = command = 0.0
    for k in range(r.size):
        J = 2.0 * (stiffer if k >= r.size // 2 else 1.0)
        y[k] = rate + 1e-4 * rng.standard_normal()
        u[k] = command + r[k]
        integral += h * y[k]
        command = -100.0 * (y[k] + 10.0 * integral)
        rate += h * (u[k] - 4.0 * rate) / J
    return LoopRecord("own", h, r, u, y, PLACES[0], UNITS)


@pytest.fixture(scope="module")
def steady() -> LoopRecord:
    return own()


def test_a_loop_that_changes_is_said(steady: LoopRecord) -> None:
    """Margins of the mean of two loops belong to neither, and their interval was that of noise."""
    changed = identify_record(own(stiffer=1.2))
    assert "the loop changed" in changed.dependent and any("the loop changed" in n for n in changed.notes)
    found = identify_record(steady)
    assert not found.dependent and not any("changed" in n or "fall" in n for n in found.notes)


def test_a_step_of_the_sensor_is_no_change_of_the_loop(steady: LoopRecord) -> None:
    y = steady.y + 5.0 * steady.y.std() * (np.arange(steady.y.size) > 0.55 * steady.y.size)
    assert not any("changed" in n for n in identify_record(replace(steady, y=y)).notes)


@pytest.mark.parametrize("mistake", ["late", "scale", "controller"])
def test_an_input_of_another_kind_is_said(steady: LoopRecord, mistake: str) -> None:
    """The margins were stated to a tenth of a degree, 5 to 50 degrees off."""
    u = {"late": np.roll(steady.u, 2), "scale": 3.0 * steady.u, "controller": steady.u - steady.r}[mistake]
    found = identify_record(replace(steady, u=u))
    assert "does not fall" in found.dependent and any("does not fall" in n for n in found.notes)


@pytest.mark.parametrize("stated", [0.0, PERIOD * H])
def test_a_block_that_is_missing_is_found(steady: LoopRecord, stated: float) -> None:
    """The times are even, as those of samples that were counted; the longer piece has the margins of the whole."""
    first, missing = 9_300, 1_700
    keep = np.r_[0:first, first + missing : steady.r.size]
    cut = replace(steady, period=stated, **{n: getattr(steady, n)[keep] for n in ("r", "u", "y")})
    found, whole = identify_record(cut), identify_record(steady)
    assert missing_blocks(cut) == ([first], []) and missing_blocks(steady) == ([], [])
    assert found.record.r.size == cut.r.size - first and found.period == PERIOD * H
    assert any("9.3 s after the first: a block of the record is missing" in n for n in found.notes)
    assert whole["phase margin"].value in found["phase margin"]


def test_without_a_loop_the_plant_alone_is_identified() -> None:
    """J = 2 kg·m², c = 4 N·m·s driven by a step in the middle of noise: |P| at 4 Hz by hand, no margin, no drift."""
    rng, h = np.random.default_rng(2), 1e-3
    r = np.repeat(rng.standard_normal(400), 50) + np.arange(20000) // 10000
    y = signal.lfilter([0.0, h / 2.0], [1.0, -(1.0 - 2.0 * h)], r) + 1e-5 * rng.standard_normal(r.size)
    found = identify_record(LoopRecord("own", h, r, r, y, PLACES[0], UNITS))
    assert not found.margins and found.notes[0].startswith("the input is the excitation itself")
    assert not any("drifts" in n for n in found.notes)
    k = int(np.argmin(np.abs(found.f - 4.0)))
    exact = 1.0 / abs(4.0 + 2.0j * 2.0 * np.pi * found.f[k])  # 1/(c + jωJ)
    assert abs(found.responses["P"].value[k]) == pytest.approx(exact, rel=0.01)
    shown = page(found)
    assert [s.title for s in shown.sections][:2] == ["Margins", "Plant"] and "of identification" in shown.words["end"]


def test_nothing_passes_at_a_limit(steady: LoopRecord) -> None:
    """A fifth of the time there, by the limit of the input; a coarse signal, of 30 steps, is not at one."""
    top = float(np.quantile(np.abs(steady.u), 0.8))
    limited = identify_record(replace(steady, u=np.clip(steady.u, -top, top)))
    assert "at its limit" in limited.dependent or "odd harmonics" in limited.dependent
    assert any("the input is at its largest or smallest value for 20 % of the time" in n for n in limited.notes)
    slow = np.sin(2.0 * np.pi * np.arange(20000) / 4000.0)
    assert _share_at_ends(np.round(15.0 * slow)) == 0.0
    assert _share_at_ends(np.clip(np.round(15.0 * slow), -12.0, 12.0)) == pytest.approx(0.444, abs=0.005)


def test_few_lines_show_it_too() -> None:
    """Three lines in the second octave from the end: S late by a sample of 2 ms of L = 100/(2 pi f i), by hand."""
    f = np.array([1.0, 2.0, 4.0, 8.0, 12.0, 16.0, 25.0, 30.0, 38.0, 45.0, 52.0, 60.0, 70.0, 80.0])
    S, none = 1.0 / (1.0 + 100.0 / (2j * np.pi * f)), np.zeros(f.size)
    for late, said in ((0.0, False), (2e-3, True)):
        value = S * np.exp(-2j * np.pi * f * late)
        text, doubted = level_end(MeasuredResponse(f, value, none + 1e-3, none + 10.0, value, none))
        assert bool(text) is said and doubted is said
