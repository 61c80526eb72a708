"""Several results of one run - channels measured at once, parts of a suite - as one."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from gyrobench.result import DriftTestResult, Reason, Table, TypeB


def merge(
    results: Mapping[str, DriftTestResult], *, equation: str | None = None, summary: Sequence[str] | None = None,
    tables: Sequence[Table] = (), reasons: Sequence[Reason] = (),
) -> DriftTestResult:  # fmt: skip
    """One result of ``results`` (channel -> result, printed as "x channel: ..."), in this order.

    Coefficients, series, tests, budget and tables follow one another, named by channel where channels could have the
    same name.  The noise of different channels is taken as uncorrelated: the correlation, of type A, is block-diagonal.
    A type B source that channels share (an axis of the table, the mount of the gyro) is one error in all of them.
    condition: the worst; rank and dof: sums; residual_std: pooled.  Autocorrelation, Allan deviation and spectrum
    are those of the channel with the largest residuals (of those in the unit of the first); ``noise`` says which.  A
    reason or convention that all share is said once.  Title, method, site, instrument, provenance: of the first.
    equation: Typst math in place of the channels' own below one another.  Raises ValueError for coefficients of the
    same name.
    """
    labels, parts = list(results), list(results.values())
    first = parts[0]
    coefficients = [c for r in parts for c in r.coefficients]
    names = [c.name for c in coefficients]
    twice = sorted({n for n in names if names.count(n) > 1})
    if twice:
        raise ValueError(f"coefficient {', '.join(twice)} in more than one channel; name them apart")
    same = [r for r in parts if r.residual_unit == first.residual_unit]
    loud = max(same, key=lambda r: r.residual_std)
    dof = sum(r.dof for r in same)
    spread = math.sqrt(sum(r.dof * r.residual_std**2 for r in same) / dof) if dof > 0.0 else 0.0
    noise = {f"{n}: {key}": value for n, r in results.items() for key, value in r.noise.items()}
    if len(same) > 1:
        noise["channel of autocorrelation, Allan deviation and spectrum"] = labels[parts.index(loud)]
    equations = list(dict.fromkeys(r.equation for r in parts if r.equation))
    said = replace(
        first,
        sources=_once([r.sources for r in parts]),
        equation=" \\ ".join(equations) if equation is None else equation,
        conventions=_shared(labels, [r.conventions for r in parts]),
        reasons=[*_shared_reasons(results), *reasons],
        summary=[s for r in parts for s in r.summary] if summary is None else list(summary),
        simulated=any(r.simulated for r in parts),
        ideal=all(r.ideal for r in parts),
    )
    fitted = replace(
        said,
        coefficients=coefficients,
        correlation=_block([r.correlation for r in parts]),
        condition=max(r.condition for r in parts),
        rank=sum(r.rank for r in parts),
        dof=sum(r.dof for r in parts),
        noise=noise,
        residual_std=spread,
        budget=[b for r in parts for b in r.budget],
        type_b=_side_by_side(parts),
    )
    every = results.items()
    named = [replace(t, id=f"{t.id}:{n}", title=f"{t.title}, {n}") for n, r in every for t in r.tables]
    return replace(
        fitted,
        series=[replace(s, label=f"{n}: {s.label}") for n, r in every for s in r.series],
        tests=[replace(t, id=f"{t.id}:{n}", name=f"{t.name}, {n}") for n, r in every for t in r.tests],
        harmonics=[replace(h, series=f"{n}: {h.series}") for n, r in every for h in r.harmonics],
        repeatability={f"{n}: {key}": value for n, r in every for key, value in r.repeatability.items()},
        tables=[*named, *tables],
        acf=loud.acf,
        allan=loud.allan,
        psd=loud.psd,
    )


def _once(lists: list[list[str]]) -> list[str]:
    return list(dict.fromkeys(text for texts in lists for text in texts))


def _shared(labels: list[str], lists: list[list[str]]) -> list[str]:
    """Every text once: as it is when all lists hold it, else after the names of those that do."""
    out = []
    for text in _once(lists):
        who = [n for n, texts in zip(labels, lists, strict=True) if text in texts]
        out.append(text if len(who) == len(labels) else f"{', '.join(who)}: {text}")
    return out


def _shared_reasons(results: Mapping[str, DriftTestResult]) -> list[Reason]:
    """Return every reason once; what a channel says stays of its own coefficients, and names it."""
    told = list(dict.fromkeys(reason for r in results.values() for reason in r.reasons))
    out = []
    for reason in told:
        who = {n: r for n, r in results.items() if reason in r.reasons}
        if len(who) == len(results):
            out.append(reason)
            continue
        names = reason.names or tuple(c.name for r in who.values() for c in r.coefficients)
        names = names if reason.blocks else ()
        out.append(replace(reason, text=f"{', '.join(who)}: {reason.text}", names=names))
    return out


def _side_by_side(parts: list[DriftTestResult]) -> list[TypeB]:
    """Type B of all channels.  A source that several channels name is one error, the same for all of them: its
    independent parts (rows) go through all estimates; what is a channel's own has zeros for the others.
    """
    size, at = sum(len(r.coefficients) for r in parts), 0
    rows: dict[tuple[str, str], list[list[float]]] = {}
    for r in parts:
        for b in r.type_b:
            shared = rows.setdefault((b.id, b.source), [])
            for k, own in enumerate(b.changes):
                if k == len(shared):
                    shared.append([0.0] * size)
                shared[k][at : at + len(own)] = own
        at += len(r.coefficients)
    return [TypeB(*source, changes) for source, changes in rows.items()]


def _block(blocks: list[list[list[float]]]) -> list[list[float]]:
    size, out, at = sum(len(b) for b in blocks), [], 0
    for b in blocks:
        out += [[0.0] * at + list(row) + [0.0] * (size - at - len(row)) for row in b]
        at += len(b)
    return out
