"""How a column of a long record was taken: what a reading is, sampling, counts."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Reading:
    """Progress of a file that is read."""

    rows: int
    fraction: float
    elapsed: float

    @property
    def words(self) -> str:
        """Return rows and rate for a person."""
        return f"{self.rows / 1e6:.1f} million rows, {self.rows / max(self.elapsed, 1e-9) / 1e6:.2f} million/s"


@dataclass
class Acquisition:
    """Acquisition as the file states it; times in s."""

    step: float = 0.0
    samples: int = 0
    first: float = 0.0
    last: float = 0.0
    gaps: int = 0
    missing: int = 0  # samples on the grid that are not there
    flagged: int = 0
    incomplete: int = 0  # rows without a value
    jitter: float = 0.0  # of the time stamps against even steps, rms, in steps
    rounded: float = 0.0  # s, to which the stamps are rounded, where that is their jitter
    longest: tuple[float, float] = (0.0, 0.0)  # gap: its beginning and its length
    resets: dict[str, int] = field(default_factory=dict)
    wraps: dict[str, int] = field(default_factory=dict)
    stuck: dict[str, int] = field(default_factory=dict)  # samples at the limit of a converter, 0: at none
    frozen: dict[str, tuple[int, float]] = field(default_factory=dict)  # samples of a run of one value, its time
    repeated: int = 0  # rows that are those before
