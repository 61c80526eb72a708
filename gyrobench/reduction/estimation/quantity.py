"""A quantity that a reduction estimates: name, meaning, printed unit, truth where it is known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from gyrobench import drift, units


@dataclass(frozen=True)
class Quantity:
    """One quantity that is estimated: its name, what it means, its printed unit and that unit's size in SI.

    truth and closed (the source's formula on the same data): SI, None where there is none.  shown: the printed name
    where it differs, as for the combination that a coefficient stands for; limits are looked up under both.
    combination: coefficient of the drift model -> its factor in it (per g0^n); empty: it is the one of its name.  Where
    |f| is the same in all attitudes D_OO (Dx_yy, Dy_xx) is folded into the others and left out.
    """

    name: str
    meaning: str
    unit: str  # "°/h/g"
    scale: float
    truth: float | None = None
    closed: float | None = None
    shown: str = ""
    combination: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def of(
        cls, name: str, meaning: str, unit: str, truth: float | None = None, closed: float | None = None
    ) -> Quantity:
        """With the printed form and the size of a unit that gyrobench.units knows: "deg/h", "mA", "arcsec"."""
        return cls(name, meaning, units.display(unit), units.factor(unit), truth, closed)

    @classmethod
    def drift(cls, name: str, truth: float | None = None, closed: float | None = None, meaning: str = "") -> Quantity:
        """Return a drift coefficient in rad/s per g0^n: D_F, D_IS ..., or Dx_0, Dy_yz ... of a channel."""
        unit = units.display(drift.surface_unit(name))
        return cls(name, meaning or drift.meaning(name), unit, units.factor("deg/h"), truth, closed)

    @property
    def title(self) -> str:
        return self.shown or self.name
