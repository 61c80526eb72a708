"""The tables of docs/validation.md:  python docs/validation/build.py [--write]

Certified and published values against what the bench's own estimators give.  Without --write: exit code 1 where the
page differs.  LRE = -log10(|x - c| / |c|), for c = 0 -log10|x|; never above the digits that the reference states.
"""

from __future__ import annotations

import math
import re
import sys
import tomllib
import warnings
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy import optimize

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.regression import Fit, RegressionError, least_squares
from gyrobench.reduction.estimation.repeatability import statistics
from gyrobench.reduction.estimation.uncertainty import combine_uncertainties
from gyrobench.reduction.series.column_regression import joint_test
from gyrobench.reduction.series.correlation import autocovariance
from gyrobench.reduction.series.deviations import KINDS, DeviationAccumulator, _Stage, deviations

HERE = Path(__file__).parent
PAGE = HERE.parent / "validation.md"
PART = re.compile(r"(<!--table (\w+)-->\n).*?(<!--end table-->)", re.S)
sys.path.insert(0, str(HERE))
from nonlinear_models import MODELS  # type: ignore[import-not-found, unused-ignore]  # noqa: E402

Row = tuple[str, ...]


def lre(value: float, certified: float, most: float) -> float:
    """Return the digits of ``value`` that agree, at most ``most``, at least 0; 0 for a value that is not finite."""
    error = abs(value - certified) / (abs(certified) or 1.0)
    if not math.isfinite(error):
        return 0.0
    return max(0.0, min(most, -math.log10(error))) if error else most


def worst(values: Iterable[float], certified: Sequence[float], most: float) -> float:
    """Return the least LRE of several."""
    return min(lre(v, c, most) for v, c in zip(values, certified, strict=True))


def read(name: str) -> dict[str, dict[str, Any]]:
    """Return the sets of a file; "rows" as an array, rows 2 and 3 repeated as the set says."""
    sets = tomllib.loads((HERE / "data" / f"{name}.toml").read_text(encoding="utf-8"))
    for entry in sets.values():
        if name == "univariate":
            table = np.array(entry["rows"].split(), dtype=float)
        else:
            table = np.array([line.split() for line in entry["rows"].strip().splitlines()], dtype=float)
        repeat = entry.get("repeat", 1)
        entry["rows"] = np.concatenate([table[:1], np.concatenate([table[1:3]] * repeat)]) if repeat > 1 else table
    return sets


def linear() -> dict[str, tuple[float, float, float] | str]:
    """Return the digits of b, u(b) and s of each linear set, or the words of the refusal."""
    found: dict[str, tuple[float, float, float] | str] = {}
    for name, e in read("linear").items():
        y, x = e["rows"][:, 0], e["rows"][:, 1:]
        first, p = e["first_power"], len(e["beta"])
        X = np.column_stack([np.ones_like(y), x]) if x.shape[1] > 1 else x ** np.arange(first, first + p)
        try:
            fit = least_squares(X, y, [f"B{k}" for k in range(first, first + p)])
        except RegressionError as error:
            found[name] = str(error)
            continue
        found[name] = (worst(fit.beta, e["beta"], 15), worst(fit.u, e["u"], 15), lre(fit.s, e["s"], 15))
    return found


def _gauss_newton(name: str, b: Array, x: Array, y: Array) -> Fit:
    """Return the last linear step; derivatives by the complex step, exact to rounding."""
    names = [f"b{k + 1}" for k in range(b.size)]
    best, least = None, math.inf
    for _ in range(60):
        jacobian = np.column_stack(
            [MODELS[name](b + 1e-30j * max(abs(b[k]), 1.0) * (np.arange(b.size) == k), x).imag for k in range(b.size)]
        ) / (1e-30 * np.maximum(np.abs(b), 1.0))
        fit = least_squares(jacobian, y - MODELS[name](b, x), names)
        step = float(np.max(np.abs(fit.beta / b)))
        if step >= least and step < 1e-6:  # rounding from here on
            break
        best, least = fit, step
        b = b + fit.beta
    assert best is not None
    return Fit(best.names, b, best.covariance, best.s, best.dof, best.fitted, best.residual, best.gain)


def nonlinear() -> dict[str, tuple[int, float, float, float] | str]:
    """Return the start (1 far, 2 near) and the digits of b, u(b), rss of each set, or why there is none."""
    found: dict[str, tuple[int, float, float, float] | str] = {}
    for name, e in read("nonlinear").items():
        y, x = e["rows"][:, 0], e["rows"][:, 1]
        if name == "Nelson":
            y, x = np.log(y), e["rows"][:, 1:].T
        found[name] = "neither start reaches it"
        for start in (1, 2):
            try:
                with np.errstate(all="ignore"), warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    near = optimize.least_squares(
                        lambda b, x=x, y=y, name=name: MODELS[name](b, x) - y,
                        e[f"start_{start}"], x_scale="jac", method="lm", max_nfev=4000, xtol=1e-12, ftol=1e-12,
                    ).x  # fmt: skip
                    fit = _gauss_newton(name, near, x, y)
            except (RegressionError, ValueError) as error:
                found[name] = str(error)
                continue
            digits = worst(fit.beta, e["beta"], 11)
            rss = lre(float(np.sum((y - MODELS[name](fit.beta, x)) ** 2)), e["rss"], 11)
            if digits >= 4:
                found[name] = (start, digits, worst(fit.u, e["u"], 11), rss)
                break
    return found


def anova() -> dict[str, tuple[float, float]]:
    """Return the digits of F and s of each analysis of variance: a mean, and a column for each further treatment."""
    found: dict[str, tuple[float, float]] = {}
    for name, e in read("anova").items():
        n, k = e["rows"].shape
        y, group = e["rows"].ravel(), np.tile(np.arange(k), n)
        X = np.column_stack([np.ones(y.size), *((group == j).astype(float) for j in range(1, k))])
        fit = least_squares(X, y, [f"c{j}" for j in range(k)])
        F, _ = joint_test(fit.beta[1:], fit.covariance[1:, 1:], fit.dof)
        found[name] = (lre(F, e["F"], 15), lre(fit.s, e["s"], 15))
    return found


def univariate() -> dict[str, tuple[float, float, float]]:
    """Return the digits of mean, s and r(1) of each set."""
    found: dict[str, tuple[float, float, float]] = {}
    for name, e in read("univariate").items():
        x = e["rows"]
        of, digits = statistics(x.tolist()), math.nan
        if x.size >= 4:
            r = autocovariance(x, 1)
            digits = lre(float(r[1] / r[0]), e["r1"], 15)
        found[name] = (lre(of.mean, e["mean"], 15), lre(of.sigma, e["s"], 15), digits)
    return found


NBS14 = (892.0, 809.0, 823.0, 798.0, 671.0, 644.0, 883.0, 903.0, 677.0)
PUBLISHED_NBS14: dict[str, tuple[float, ...]] = {
    "allan": (91.22945, 85.95287),
    "modified": (91.22945, 74.78849),
    "hadamard": (70.80607, 85.61487),
}
PUBLISHED_1000: dict[str, tuple[float, ...]] = {  # tau = 1, 10, 100, overlapping
    "allan": (2.922319e-01, 9.159953e-02, 3.241343e-02),
    "modified": (2.922319e-01, 6.172376e-02, 2.170921e-02),
    "hadamard": (2.943883e-01, 9.581083e-02, 3.237638e-02),
}


def sp1065_record() -> Array:
    """Return the 1,000 rates of SP1065: n' = 16807 n mod 2147483647 from 1234567890, over 2147483647."""
    n = [1234567890]
    while len(n) < 1000:
        n.append(16807 * n[-1] % 2147483647)
    return np.array(n) / 2147483647.0


def allan() -> list[tuple[str, str, float, float, float]]:
    """Return (set, kind, tau, published, found)."""
    rows = []
    small = deviations(np.array(NBS14), 1.0, KINDS)
    for kind, published in PUBLISHED_NBS14.items():
        rows += [("NBS14", kind, small[kind].tau[i], p, small[kind].deviation[i]) for i, p in enumerate(published)]
    total = DeviationAccumulator(1.0, KINDS)
    total._stages = [_Stage(1, [1, 10, 100], KINDS)]  # the same sums at decades, where the published values are
    total.add(sp1065_record())
    large = total.result()
    for kind, published in PUBLISHED_1000.items():
        rows += [
            ("1,000 points", kind, large[kind].tau[i], p, large[kind].deviation[i]) for i, p in enumerate(published)
        ]
    return [(a, b, float(t), p, float(v)) for a, b, t, p, v in rows]


TN1900_E2 = (
    18.75, 28.25, 25.75, 28.00, 28.50, 20.75, 21.00, 22.75, 18.50, 27.25, 20.75,
    26.50, 28.00, 23.25, 28.00, 21.75, 26.00, 26.50, 28.00, 33.25, 32.00, 29.50,
)  # fmt: skip
GUM_H3 = (
    (21.521, -0.171), (22.012, -0.169), (22.512, -0.166), (23.003, -0.159), (23.507, -0.164), (23.999, -0.165),
    (24.513, -0.156), (25.002, -0.157), (25.503, -0.159), (26.010, -0.161), (26.511, -0.160),
)  # fmt: skip


def gum() -> list[tuple[str, str, float, float, float]]:
    """Return (example, quantity, published, found, half a unit of the last published digit)."""
    day = np.array(TN1900_E2)
    mean = least_squares(np.ones((day.size, 1)), day, ["tau"])
    half = float(mean.half_width()[0])
    t, b = np.array(GUM_H3).T
    line = least_squares(np.column_stack([np.ones_like(t), t - 20.0]), b, ["y1", "y2"])
    r = float(line.covariance[0, 1] / (line.u[0] * line.u[1]))
    at30 = np.array([1.0, 10.0])
    rows = [
        ("TN 1900 E2", "mean, °C", 25.6, float(mean.beta[0]), 0.05),
        ("TN 1900 E2", "u, °C", 0.872, float(mean.u[0]), 0.0005),
        ("TN 1900 E2", "95 % interval, lower end, °C", 23.8, float(mean.beta[0]) - half, 0.05),
        ("TN 1900 E2", "95 % interval, upper end, °C", 27.4, float(mean.beta[0]) + half, 0.05),
        ("GUM H.3", "y1, °C", -0.1712, float(line.beta[0]), 5e-5),
        ("GUM H.3", "u(y1), °C", 0.0029, float(line.u[0]), 5e-5),
        ("GUM H.3", "y2", 0.00218, float(line.beta[1]), 5e-6),
        ("GUM H.3", "u(y2)", 0.00067, float(line.u[1]), 5e-6),
        ("GUM H.3", "r(y1, y2)", -0.930, r, 5e-4),
        ("GUM H.3", "u of the correction at 30 °C, °C", 0.0041, float(np.sqrt(at30 @ line.covariance @ at30)), 5e-5),
    ]
    u, U = combine_uncertainties(0.0, 0.0, [1.0] * 4)
    rows += [("S1 9.2.2, four normal", "u", 2.0, u, 0.05), ("S1 9.2.2, four normal", "U", 3.92, U, 0.005)]
    rows += [("S1 9.2.3, four rectangular", "u", 2.0, u, 0.05), ("S1 9.2.3, four rectangular", "U", 3.88, U, 0.005)]
    u, U = combine_uncertainties(0.0, 0.0, [1.0] * 3 + [10.0])
    rows += [("S1 9.2.4, one dominates", "u", 10.1, u, 0.05), ("S1 9.2.4, one dominates", "U", 17.0, U, 0.05)]
    return rows


def table(head: Row, rows: Iterable[Row]) -> str:
    """Return a Markdown table."""
    lines = [head, ("---",) * len(head), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _digits(*values: float) -> Row:
    """Digits rounded down to whole ones: another machine's rounding moves a fraction."""
    return tuple("—" if math.isnan(v) else f"{math.floor(v + 0.05)}" for v in values)


def tables() -> dict[str, str]:
    """Return every table of the page by name."""
    lines = [(n, *_digits(*v)) if not isinstance(v, str) else (n, *["refused"] * 3) for n, v in linear().items()]
    curves = [
        (n, str(v[0]), *_digits(*v[1:])) if not isinstance(v, str) else (n, "—", v, "", "")
        for n, v in nonlinear().items()
    ]
    spread = [(n, *_digits(*v)) for n, v in anova().items()]
    single = [(n, *_digits(*v)) for n, v in univariate().items()]
    noise = [(a, b, f"{t:g}", f"{p:.7g}", f"{v:.7g}") for a, b, t, p, v in allan()]
    laws = [
        (a, b, f"{p:g}", f"{v:.4g}", "yes" if abs(v - p) <= 1.0001 * half else f"no, {100 * (v / p - 1):+.1f} %")
        for a, b, p, v, half in gum()
    ]
    return {
        "linear": table(("set", "b", "u(b)", "s"), lines),
        "nonlinear": table(("set", "start", "b", "u(b)", "sum of squares"), curves),
        "anova": table(("set", "F", "s"), spread),
        "univariate": table(("set", "mean", "s", "r(1)"), single),
        "allan": table(("set", "deviation", "τ", "published", "bench"), noise),
        "gum": table(("example", "quantity", "published", "bench", "agrees to the printed digits"), laws),
    }


def main() -> int:
    """Compare the page, or write it."""
    made, old = tables(), PAGE.read_text(encoding="utf-8")
    new = PART.sub(lambda m: m[1] + made[m[2]] + m[3], old)
    if "--write" in sys.argv[1:]:
        PAGE.write_text(new, encoding="utf-8")
    elif new != old:
        print("docs/validation.md differs; run: python docs/validation/build.py --write")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
