"""Views of long signals: every extreme is there, nothing is invented, few points."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from gyrobench.record.mapped_column import mapped, release
from gyrobench.record.record import LONG, ColumnsOnRequest, write_table
from gyrobench.record.signal_view import LiveSignals, SignalPyramid


@pytest.mark.parametrize("length", [0, 1, 2, 15, 16, 17, 63, 64, 65, 1000, 4097, 100_003])
def test_extremes_of_any_stretch_are_in_its_view(length: int) -> None:
    random = np.random.default_rng(length)
    t = np.cumsum(random.uniform(0.1, 1.0, length))
    y = random.standard_normal(length)
    pyramid = SignalPyramid(t, y)
    for _ in range(20):
        begin, end = sorted(random.uniform(-5.0, (t[-1] if length else 0.0) + 5.0, 2))
        view = pyramid.view(begin, end, 200)
        assert len(view.time) <= 2 * 200 + 4 and np.all(np.diff(view.time) > 0.0)
        at = np.searchsorted(t, view.time)
        assert np.array_equal(t[at], view.time) and np.array_equal(y[at], view.values), "points that are no samples"
        inside = y[(t >= begin) & (t <= end)]
        if len(inside):
            assert view.values.min() <= inside.min() and view.values.max() >= inside.max()
            # and beyond the edges no more than the sample beside each
            assert view.time[0] >= t[max(0, np.searchsorted(t, begin) - 1)]


def test_every_sample_of_a_short_stretch() -> None:
    t = np.arange(10_000.0)
    view = SignalPyramid(t, np.sin(t)).view(100.0, 200.0, 500)
    assert np.array_equal(view.time, np.arange(99.0, 202.0)) and view.every == 1


def test_one_sample_that_stands_out_is_never_lost() -> None:
    y = np.zeros(1_000_000)
    y[654_321] = 1.0
    pyramid = SignalPyramid(np.arange(1e6), y)
    for begin in (0.0, 600_000.0, 654_000.0):
        view = pyramid.view(begin, 1e6, 1000)
        assert view.values.max() == 1.0 and view.time[np.argmax(view.values)] == 654_321.0


def test_what_is_not_finite_hides_nothing() -> None:
    y = np.arange(10_000.0)
    y[::2] = np.nan
    y[5000:5100] = np.nan
    view = SignalPyramid(np.arange(10_000.0), y).view(0.0, 1e4, 400)
    assert np.nanmax(view.values) == 9999.0 and np.nanmin(view.values) == 1.0
    all_gone = SignalPyramid(np.arange(100.0), np.full(100, np.nan)).view(0.0, 100.0, 20)
    assert np.all(np.isnan(all_gone.values)) and len(all_gone.time)


def test_times_and_values_belong_together() -> None:
    with pytest.raises(ValueError, match="3 times, 2 values"):
        SignalPyramid(np.arange(3.0), np.arange(2.0))


def test_no_stretch_needs_more_than_its_points() -> None:
    """A million samples, any stretch: the level that is taken has 2 (last - first) / every <= points places."""
    t = np.arange(1e6)
    pyramid = SignalPyramid(t, np.sin(1e-3 * t))
    for k in range(0, 500, 7):
        view = pyramid.view(1e3 * k, 1e6 - 1e3 * k)
        assert 100 < len(view.time) <= 2000 + 4  # the edges, and a bucket cut at each


# ---------------------------------------------------------------------------------------- while they come
def test_live_signals_keep_the_extremes_of_every_stretch() -> None:
    random = np.random.default_rng(3)
    t = np.arange(100_000.0)
    table = np.column_stack([t, random.standard_normal((len(t), 3))])
    table[60_000, 2] = 50.0
    live = LiveSignals(1200)
    for begin in range(0, len(t), 700):
        live.add(table[max(0, begin - 50) : begin + 700])  # some rows come once more
        assert len(live.rows) <= 1200 + 700
    assert np.all(np.diff(live.rows[:, 0]) > 0.0)
    assert np.array_equal(live.rows, table[live.rows[:, 0].astype(int)]), "rows that are none of the record"
    assert 50.0 in live.rows[:, 2]
    for number in range(int(t[-1] // live.stretch)):
        stretch = table[(t // live.stretch) == number]
        kept = live.rows[(live.rows[:, 0] // live.stretch) == number]
        assert np.array_equal(stretch[:, 1:].min(axis=0), kept[:, 1:].min(axis=0))
        assert np.array_equal(stretch[:, 1:].max(axis=0), kept[:, 1:].max(axis=0))


def test_live_signals_take_what_is_torn() -> None:
    """Rows out of order, and of no time at all, come from memory that is written meanwhile."""
    live = LiveSignals()
    live.add(np.array([[0.0, 1.0], [1.0, 2.0], [0.5, 9.0], [np.nan, 9.0], [2.0, 3.0]]))
    live.add(np.empty((0, 2)))
    live.add(np.array([[2.0, 9.0], [3.0, np.nan]]))
    assert live.rows[:, 0].tolist() == [0.0, 1.0, 2.0, 3.0]
    assert 9.0 not in live.rows[:, 1]


def test_a_long_column_stays_on_the_disk_and_is_what_it_was(tmp_path: Path) -> None:
    """Values bit for bit, a view of them too, after their memory was given back; nothing can be written into them."""
    rng = np.random.default_rng(5)
    time, values = np.arange(LONG + 1000) * 1e-3, rng.standard_normal(LONG + 1000)
    write_table(tmp_path / "channels", {"time": time, "y": values})
    columns = ColumnsOnRequest(tmp_path / "channels.parquet")
    held = columns["y"]
    np.testing.assert_array_equal(held, values)
    assert not held.flags.writeable
    ours, plain = SignalPyramid(columns["time"], held), SignalPyramid(time, values)
    for stretch in ((0.0, 1e9), (3.0, 4.0), (100.0, 200.0)):
        np.testing.assert_array_equal(ours.view(*stretch).values, plain.view(*stretch).values)
    assert ours.values is held, "no copy"


@pytest.mark.skipif(not Path("/proc/self/smaps").is_file(), reason="the memory of a mapping is told by Linux alone")
@pytest.mark.long
def test_memory_is_given_back() -> None:
    held = mapped(np.full(1 << 20, float(k)) for k in range(4))

    def resident() -> int:
        place, found = held.ctypes.data, 0
        for line in Path("/proc/self/smaps").read_text().splitlines():
            if re.match(r"[0-9a-f]+-[0-9a-f]+ ", line):
                low, high = (int(x, 16) for x in line.split()[0].split("-"))
                inside = low <= place < high
            elif line.startswith("Rss:") and inside:
                found = int(line.split()[1])
        return found

    assert held.sum() == (1 << 20) * 6.0 and resident() > 30_000  # kB
    release(held)
    assert resident() < 1000
    assert held[-1] == 3.0
    release(np.zeros(3))
