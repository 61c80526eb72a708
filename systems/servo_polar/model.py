"""What is fitted, and which combination each fitted coefficient stands for.  [SERVO-C3-RANK, E53]

route dwells        all terms: two dwells with x east separate R from K_zx
route equal         D_II = -D_SS put in (K_zx = K_xz), and reported so
route combination   D_II is held by D_F:  D_F + gamma2 sin2(phi) D_II
one mount (S, N)    X = +-gamma sin(phi) all day: D_I is held by D_F too, D_IO by D_O, D_IS by D_S
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gyrobench import drift
from gyrobench.arrays import Array
from gyrobench.reduction.drift import servo_regression
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.estimation.quantity import Quantity
from gyrobench.reduction.setup.run_metadata import Location

FOUR = ("D_F", "D_I", "D_S", "D_IS")
ROUTES = ("dwells", "equal", "combination")
Mixed = tuple[tuple[str, int, int], ...]  # other coefficient, sign and power of its factor gamma sin(phi)


def terms(which: int) -> tuple[str, ...]:
    """Return the coefficients of the model: 4 (R, U_z, U_x, ΔK), 8 (Hu 1981), 9 (with D_O)."""
    return {4: FOUR, 8: drift.terms(8), 9: drift.terms(9)}[which]


@dataclass(frozen=True)
class PolarModel:
    """names: of the terms; fitted: of the columns; mixed: what a fitted coefficient holds beside itself."""

    names: tuple[str, ...]
    fitted: tuple[str, ...]
    mixed: Mapping[str, Mixed]
    equal: bool = False

    @classmethod
    def of(cls, route: str, mounts: Sequence[str], which: int) -> PolarModel:
        """Return the model of a plan.  mounts: attitudes of the turns.  One mount alone decides by itself, whatever the
        route.
        """
        names = terms(which)
        if len(set(mounts)) == 1:
            m = 1 if mounts[0] == "polar S" else -1
            holds: dict[str, Mixed] = {
                "D_F": (("D_I", m, 1), ("D_II", 1, 2)), "D_O": (("D_IO", m, 1),), "D_S": (("D_IS", m, 1),),
            }  # fmt: skip
        else:
            holds = {"D_F": (("D_II", 1, 2),)} if route == "combination" else {}
        mixed = {n: tuple(o for o in holds.get(n, ()) if o[0] in names) for n in names}
        gone = {o[0] for held in mixed.values() for o in held}
        equal = route == "equal" and len(set(mounts)) > 1 and "D_II" in names
        if equal:
            gone = {"D_II"}
        return cls(names, tuple(n for n in names if n not in gone), mixed, equal)

    def columns(self, held: servo_regression.HeldWindows, site: Location) -> Array:
        """Return the columns (n, len(fitted)) of windows."""
        X = servo_regression.design(held, site, self.names)
        if self.equal:
            X[:, self.names.index("D_SS")] -= X[:, self.names.index("D_II")]
        return X[:, [self.names.index(n) for n in self.fitted]]

    def quantities(
        self, site: Location, truth: Mapping[str, float] | None, book: Mapping[str, float]
    ) -> tuple[list[Quantity], list[Quantity]]:
        """Return the quantities of what is fitted, and of what is reported."""
        share = site.g * math.sin(site.latitude)

        def one(name: str) -> Quantity:
            made_of = {name: 1.0} | {n: s * share**k for n, s, k in self.mixed[name]}
            true = None if truth is None else sum(x * truth.get(n, 0.0) for n, x in made_of.items())
            q = Quantity.drift(name, true, book.get(name))
            if not self.mixed[name]:
                return q
            meaning = f"{q.meaning}, with what one cannot tell from it"
            return replace(q, meaning=meaning, shown=self.words(name), combination=made_of)

        fitted = [one(n) for n in self.fitted]
        return fitted, [one(n) for n in self.names] if self.equal else fitted

    def report(self, found: Findings, reported: Sequence[Quantity]) -> Findings:
        """Return the fit with D_II = -D_SS written out."""
        if not self.equal:
            return found
        order = [self.fitted.index("D_SS" if n == "D_II" else n) for n in self.names]
        sign = np.array([-1.0 if n == "D_II" else 1.0 for n in self.names])
        return found.derive(reported, lambda v: sign * v[order])

    def words(self, name: str, book: bool = False) -> str:
        """Return D_F + γ² sin²φ D_II, or R + γ² sin²φ K_zx."""
        symbol, way = servo_regression.BOOK[name]
        out = [symbol if book else name]
        for n, s, k in self.mixed[name]:
            its, other = servo_regression.BOOK[n]
            plus = s * way * other if book else s
            out.append(f"{'+' if plus > 0 else '−'} {('', 'γ sinφ', 'γ² sin²φ')[k]} {its if book else n}")
        return " ".join(out)
