"""Several tests of one instrument as one result: every quantity by every method that sees it.

    combine_methods({"servo_polar": Member(result, ...), "tumble_single_axis": Member(...)}, shared=("latitude",))

``SuiteResult.coefficients`` are the weighted means (the one value, where only one method sees a quantity);
``SuiteResult.suite`` holds what the report's cross-method tables show, numbers in printed units.  [CROSS-MAP;
gyrobench.reduction.suite.consistency]
"""

from __future__ import annotations

import functools
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from gyrobench import drift, result_suite
from gyrobench.record.run_document import RunDocument, SuiteTestRun
from gyrobench.reduction.estimation.sentences import p_text, plain
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.reduction.suite import consistency, estimable_combinations
from gyrobench.reduction.suite.consistency import LEVEL, MethodValue
from gyrobench.reduction.suite.estimable_combinations import Measurand
from gyrobench.reduction.suite.ranking import adjusted
from gyrobench.result import Coefficient, DriftTestResult, Reason, SuiteComparison, SuiteResult, Test

FAMILIES = {
    "single-degree-of-freedom gyro": drift.NAMES,
    "two-degree-of-freedom gyro": sum(drift.NAMES_2DOF.values(), ()),
}
RULE = (
    "Two methods whose normalized error E_n exceeds 1 differ by more than their expanded uncertainties; of consistent "
    "methods 5 % of the pairs do. The values of a measurand are consistent when the consistency test gives p ≥ "
    f"{LEVEL:g}, p adjusted for the number of measurands (Holm). Otherwise u of the combined value is multiplied by "
    "the Birge ratio, and conformity is not stated (inconclusive)."
)


@dataclass(frozen=True)
class Member:
    """A test of the suite: its result, and where its run is kept with facts for the report."""

    result: DriftTestResult
    test: SuiteTestRun = field(default_factory=lambda: SuiteTestRun(folder="", report_id=""))


@dataclass(frozen=True)
class MeasurandComparison:
    """Values of one quantity by all methods.  found: None where one alone sees it, or nothing can be weighed."""

    quantity: Measurand
    values: tuple[MethodValue, ...]
    found: consistency.Agreement | None
    p: float | None = None  # adjusted for the number of quantities

    @property
    def disagree(self) -> bool:
        return self.p is not None and self.p < LEVEL

    @property
    def truth(self) -> float | None:
        known = [v.truth for v in self.values]
        if any(t is None for t in known):
            return None
        low, high = min(t for t in known if t is not None), max(t for t in known if t is not None)
        return low if high - low <= 1e-6 * max(abs(low), abs(high), 1e-3) else None

    @functools.cached_property
    def outlier(self) -> tuple[str, float] | None:
        """The method without which the others agree, with the p of these; None where they agree, or there is none."""
        return consistency.outlier(self.values) if self.disagree else None

    def words(self) -> str:
        """Return which methods disagree, and by how much."""
        if self.found is None:
            return "one method only" if len(self.values) == 1 else "not tested: no noise"
        significant = [
            f"{p.a} and {p.b} ({plain(p.E_n, 3)})"
            for p in sorted(self.found.pairs, key=lambda p: -p.E_n)
            if p.E_n > 1.0
        ]
        if not self.disagree:
            return f"consistent; E_n > 1: {', '.join(significant)}" if significant else "consistent"
        if self.outlier is not None:
            label, p = self.outlier
            others = consistency.combine_values([v for v in self.values if v.label != label])
            deviation = next(v for v in self.values if v.label == label).estimate - others.mean
            size = f"{plain(deviation, 2, '+')} {self.quantity.unit}".replace("-", "−")
            return f"{label} deviates by {size}; the others are consistent (p = {plain(p)})"
        which = "; the deviating method cannot be identified" if len(self.values) < 3 or len(significant) < 2 else ""
        return f"inconsistent: {', '.join(f'E_n of {x}' for x in significant) or 'no single pair'}{which}"


def compare(results: Mapping[str, DriftTestResult], shared: Collection[str]) -> list[MeasurandComparison]:
    """Return every quantity that the results report, by every one that determines it."""
    shared = common(results, shared)
    noisy = {label: not estimable_combinations.ideal(r) for label, r in results.items()}
    out = []
    for q in estimable_combinations.quantities(results):
        candidates = [estimable_combinations.value(label, q, r, shared) for label, r in results.items()]
        values = tuple(v for v in candidates if v is not None)
        weighed = len(values) > 1 and all(v.own > 0.0 and noisy[v.label] for v in values)
        out.append(MeasurandComparison(q, values, consistency.combine_values(values) if weighed else None))
    tested = [k for k, c in enumerate(out) if c.found is not None]
    for k, p in zip(tested, adjusted([out[k].found.p for k in tested]), strict=True):  # type: ignore[union-attr]
        out[k] = replace(out[k], p=p)
    return out


def common(results: Mapping[str, DriftTestResult], shared: Collection[str]) -> list[str]:
    """Return those of the sources ``shared`` (ids) that two results or more name."""
    named = [{b.id for b in r.type_b} for r in results.values()]
    return sorted(s for s in set(shared) if sum(s in sources for sources in named) > 1)


def problems(results: Mapping[str, DriftTestResult]) -> list[str]:
    """Return why the results are not of one instrument, as sentences."""
    sentences = []
    families: dict[str, list[str]] = {}
    for label, r in results.items():
        names = {n for c in r.coefficients for n in estimable_combinations.combination(c)}
        for family, known in FAMILIES.items():
            if names & set(known):
                families.setdefault(family, []).append(label)
    if len(families) > 1:
        text = "; ".join(f"{', '.join(labels)}: of a {family}" for family, labels in families.items())
        sentences.append(f"{text}; a suite compares tests of one gyro, so leave out the tests of one of the two")
    kinds = {kind: [n for n, r in results.items() if r.simulated is kind] for kind in (True, False)}
    if all(kinds.values()):
        sentences.append(f"{', '.join(kinds[True])}: simulated; {', '.join(kinds[False])}: measured; not of one gyro")
    named: dict[str, list[str]] = {}
    for label, r in results.items():
        if r.instrument and not r.simulated:
            named.setdefault(r.instrument, []).append(label)
    if len(named) > 1:
        text = "; ".join(f"{name}: {', '.join(labels)}" for name, labels in named.items())
        sentences.append(f"tests of different instruments: {text}")
    return sentences


def differences(results: Mapping[str, DriftTestResult], slots: Sequence[str] = ("gyro", "accelerometer")) -> list[str]:
    """Return where the simulated instrument was not the same in all tests, as sentences."""
    by_name: dict[str, dict[str, list[str]]] = {}
    for label, r in results.items():
        run = RunDocument.model_validate(r.provenance)
        for slot in slots:
            if slot not in run.parts:
                continue
            facts = {f"{slot}, its FMU": run.parts[slot].sha256[:16]}
            facts |= {
                n: repr(v)
                for n, v in run.parameters.items()
                if n.startswith(f"{slot}.") and not n.endswith((".seed", ".mount"))
            }
            for name, value in facts.items():
                by_name.setdefault(name, {}).setdefault(value, []).append(label)
    several = {n: values for n, values in by_name.items() if len(values) > 1}
    return [
        f"Not the same in all tests: {n} = " + "; ".join(f"{v} in {', '.join(who)}" for v, who in values.items()) + "."
        for n, values in several.items()
    ]


def combine_methods(
    members: Mapping[str, Member], *, system: str, title: str, method: str, sources: Sequence[str],
    conventions: Sequence[str] = (), shared: Collection[str] = (), failed: Mapping[str, str] | None = None,
    provenance: Mapping[str, Any] | None = None,
) -> SuiteResult:  # fmt: skip
    """Return one result of several tests.  shared: ids of sources of type B that are one error in all tests.

    failed: tests that gave no result -> why.  Raises ReductionError when the tests are not of one instrument.
    """
    results = {label: m.result for label, m in members.items()}
    if not results:
        raise ReductionError("no test of the suite has a result")
    if reasons := problems(results):
        raise ReductionError(reasons)
    compared = compare(results, shared)
    alike = common(results, shared)
    comparison = SuiteComparison(
        rule=RULE,
        shared=list(dict.fromkeys(b.source for r in results.values() for b in r.type_b if b.id in alike)),
        members=[_member(label, m) for label, m in members.items()],
        failed=[result_suite.FailedMember(n, why) for n, why in (failed or {}).items()],
        quantities=[_quantity(c) for c in compared],
        pairs=[
            result_suite.MethodPair(c.quantity.name, c.quantity.unit, p.a, p.b, p.difference, p.U, p.E_n)
            for c in compared if c.found is not None for p in c.found.pairs
        ],
        **_consistency(compared),
    )  # fmt: skip
    first, *others = results.values()
    said_alike = [s for s in first.conventions if all(s in r.conventions for r in others)]
    found = SuiteResult(
        system=system, title=title, method=method, sources=list(sources),
        conventions=list(dict.fromkeys([*conventions, *said_alike])), coefficients=[_coefficient(c) for c in compared],
        provenance=dict(provenance or {}), suite=comparison, **_facts(results),
    )  # fmt: skip
    return replace(
        found, tests=[_test(c, c.found) for c in compared if c.found is not None],
        summary=_summary(comparison, compared), reasons=_reasons(results, compared, failed or {}),
    )  # fmt: skip


def _facts(results: Mapping[str, DriftTestResult]) -> dict[str, Any]:
    """Return the site of all tests ({} where it differs), the names of the instruments, whether they are simulated."""
    first, *others = results.values()
    names = dict.fromkeys(r.instrument for r in results.values() if r.instrument)
    site = dict(first.site) if all(r.site == first.site for r in others) else {}
    return {"site": site, "instrument": ", ".join(names), "simulated": first.simulated}


def _test(c: MeasurandComparison, found: consistency.Agreement) -> Test:
    name, what = c.quantity.name, "differences beyond the u of the methods"
    return Test(f"consistency:{name}", f"consistency, {name}", found.Q, found.p, what, c.words())


def _coefficient(c: MeasurandComparison) -> Coefficient:
    q, a = c.quantity, c.found
    if a is not None:
        wide = max(1.0, a.birge) if c.disagree else 1.0
        estimate, u, U, u_a, dof = a.mean, a.u * wide, a.U * wide, a.u_a * wide, a.dof
        meaning = q.meaning
    else:
        v = min(c.values, key=lambda v: v.u)
        estimate, u, U, u_a, dof = v.estimate, v.u, v.U, v.u_a, v.dof
        meaning = f"{q.meaning}; {v.label} only" if len(c.values) == 1 else q.meaning
    truth = c.truth
    k, interval = U / u if u > 0.0 else NORMAL, (estimate - U, estimate + U)
    measured = Coefficient(q.name, meaning, q.unit, estimate, u, k, interval, combination=dict(q.combination))
    one = a is not None or len(c.values) == 1
    z = (estimate - truth) / u if truth is not None and u > 0.0 and one else None
    return replace(measured, u_a=u_a, dof=dof if math.isfinite(dof) else None, truth=truth, z=z)


def _quantity(c: MeasurandComparison) -> result_suite.SuiteQuantity:
    q, a = c.quantity, c.found
    weights = a.weights.tolist() if a is not None else [None] * len(c.values)
    values = [
        result_suite.SuiteValue(
            **{n: getattr(v, n) for n in ("label", "estimate", "u", "U", "u_a", "u_b", "u_shared", "truth")},
            dof=v.dof if math.isfinite(v.dof) else None,
            weight=w,
            how=_how(v.reported, q.name),
        )
        for v, w in zip(c.values, weights, strict=True)
    ]
    found: dict[str, Any] = dict.fromkeys(("mean", "Q", "dof", "birge", "p", "largest_E_n"))
    if a is not None:
        found = {"mean": result_suite.WeightedMean(a.mean, a.u, a.U), "Q": a.Q, "dof": len(c.values) - 1,
                 "birge": a.birge, "p": a.p, "largest_E_n": max(p.E_n for p in a.pairs)}  # fmt: skip
    found |= {"p_adjusted": c.p, "words": c.words(), "deviating": c.outlier[0] if c.outlier else ""}
    return result_suite.SuiteQuantity(
        name=q.name, unit=q.unit, meaning=q.meaning, combination=dict(q.combination), truth=c.truth, values=values,
        verdict="disagree" if c.disagree else "agree" if a else "–", **found,
    )  # fmt: skip


def _how(reported: str, name: str) -> str:
    if not reported:
        return "combination of several estimates"
    return "as reported" if reported == name else f"reported as {reported}"


def _member(label: str, m: Member) -> result_suite.SuiteMember:
    r = m.result
    return result_suite.SuiteMember(
        **{n: getattr(r, n) for n in ("system", "title", "method", "verdict", "summary", "warnings", "site")},
        **{n: getattr(r, n) for n in ("instrument", "residual_std", "condition", "rank")},
        label=label,
        unit=r.residual_unit,
        windows=sum(len(s.y) for s in r.series),
        estimates=[
            result_suite.ReportedEstimate(c.name, c.unit, c.estimate, c.u, c.k, c.interval, c.truth, c.z)
            for c in r.coefficients
        ],
        test=m.test.as_dict(),
    )


def _consistency(compared: Sequence[MeasurandComparison]) -> dict[str, Any]:
    tested = [c for c in compared if c.p is not None]
    inconsistent = [c for c in tested if c.disagree]
    pairs = [p for c in tested if c.found for p in c.found.pairs]
    return {
        "consistency": "inconsistent" if inconsistent else "consistent" if tested else "not tested",
        "p": min((c.p for c in tested if c.p is not None), default=None),
        "tested": len(tested),
        "disagreeing": [c.quantity.name for c in inconsistent],
        "pairs_apart": sum(p.E_n > 1.0 for p in pairs),
    }


def _summary(suite: SuiteComparison, compared: Sequence[MeasurandComparison]) -> list[str]:
    if suite.consistency == "not tested":
        return ["No measurand is determined by two methods with noise: consistency was not tested."]
    many = len(suite.pairs)
    agreed = (
        f"The methods are consistent in all measurands that two or more determine ({suite.tested} of {len(compared)})"
    )
    apart = f"The methods are inconsistent in {', '.join(suite.disagreeing)}"
    first = agreed if suite.consistency == "consistent" else apart
    return [
        f"{first}; smallest adjusted {p_text(suite.p or 0.0)}.",
        *(f"{c.quantity.name}: {c.words()}." for c in compared if c.disagree),
        f"E_n > 1 in {suite.pairs_apart} of {many} pairs; about {plain(0.05 * many)} are expected by chance.",
    ]


def _reasons(
    results: Mapping[str, DriftTestResult], compared: Sequence[MeasurandComparison], failed: Mapping[str, str]
) -> list[Reason]:
    """Return what a reader must know of the comparison, and the doubts of its tests."""
    said = [("suite.failed", f"{label} gave no result: {why}") for label, why in failed.items()]
    said += [("suite.instruments", text) for text in differences(results)]
    sites = {label: str(r.site) for label, r in results.items()}
    if len(set(sites.values())) > 1:
        said.append(
            (
                "suite.sites",
                "The tests were made at different site values, stated with each test. Where gravity differs, "
                "the contribution of D_OO to the combinations differs too.",
            )
        )
    counts = [f"{label} {len(r.warnings)}" for label, r in results.items() if r.warnings]
    if counts:
        said.append(("suite.warned", f"Tests with warnings, stated with each test: {', '.join(counts)}."))
    single = [c.quantity.name for c in compared if len(c.values) == 1]
    if single:
        text = f"Determined by one method only and not confirmed by another: {', '.join(single)}."
        said.append(("suite.single", text))
    negative = [c.quantity.name for c in compared if c.found is not None and min(c.found.weights) < 0.0]
    if negative:
        text = "a weight in the mean is negative, because methods share an error of different size."
        said.append(("suite.negative_weight", f"{', '.join(negative)}: {text}"))
    both = ("pass", "fail")
    doubts = [replace(r, text=f"{label}: {r.text}", blocks=both, names=()) for label, result in results.items()
              for r in result.reasons if r.severity == "doubt"]  # fmt: skip
    if apart := tuple(c.quantity.name for c in compared if c.disagree):
        doubts.append(Reason("suite.inconsistent", "The methods are inconsistent.", both, apart, severity="condition"))
    return [*doubts, *(Reason(*one) for one in said)]
