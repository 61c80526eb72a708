"""The commands campaign and sweep: definition from a file or from arguments, progress, summary."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gyrobench.bench import Bench, UsageError, display_path
from gyrobench.commands import console
from gyrobench.commands.progress_display import ProgressDisplay
from gyrobench.report.language import ENGLISH

if TYPE_CHECKING:
    from gyrobench.campaign.execution.campaign_execution import CampaignOutcome
    from gyrobench.campaign.execution.definition import Definition

REASONS = 5  # shown of each state


def from_arguments(
    system: str,
    over: Sequence[str],
    seeds: int,
    values: Sequence[str] | None,
    part: Sequence[str] | None,
    mapping: Sequence[str] | None,
    more: dict[str, Any],
) -> Definition:
    """Return the definition of a sweep.  Raises UsageError."""
    from gyrobench.campaign.execution.definition import from_mapping
    from gyrobench.commands.arguments import parse_assignments, parse_settings, parse_swaps

    axes = parse_assignments(list(over), "--over", "latitude=0deg..80deg:9")
    parts, maps = parse_swaps(list(part or []), list(mapping or []))
    given = {k: v for k, v in more.items() if v is not None}
    content = {"system": system, "over": axes, "seeds": seeds, "set": parse_settings(list(values or [])), **given}
    return from_mapping({**content, "parts": parts, "maps": {s: str(f) for s, f in maps.items()}}, where="sweep")


def require_certifiable(data: str | None, keep: str | None) -> str:
    """Return that all reports are kept.  Raises UsageError where a certificate cannot be of what is asked for."""
    from gyrobench.workflow.certificate import find_laboratory

    if data is None:
        raise UsageError("--certificate is of measured files: name them by --data")
    if keep not in (None, "all"):
        raise UsageError(f"--certificate needs the reports of all files: --keep all, not {keep}")
    find_laboratory()
    return "all"


def default_out(definition: Definition, sweep: bool) -> str:
    """Return where a campaign is stored unless a place is named: by its name, a sweep by its content.

    Raises UsageError for a name that leads elsewhere.
    """
    if not sweep:
        if {"..", Path(definition.name).anchor} & {*Path(definition.name).parts}:
            raise UsageError(f"name = {definition.name}: the folder of a campaign is named so: leave out '..' and '/'")
        return str(Bench.find().out / "campaigns" / definition.name)
    text = json.dumps(definition.as_given(), sort_keys=True)
    return str(Bench.find().out / "campaigns" / f"{definition.system}-{hashlib.sha256(text.encode()).hexdigest()[:8]}")


def run(
    definition: Definition,
    out: str,
    scheduler: str | None,
    workers: int | None,
    retry: bool,
    as_json: bool,
    site: bool = False,
    certificate: bool = False,
    language: str = ENGLISH,
) -> bool:
    """Execute a campaign and print what it has; return whether every run is done and none fails its specification.

    site, certificate: write the site of the campaign, in a language, and the certificate of its lot, too.
    """
    from gyrobench.campaign.execution.campaign_execution import execute_campaign

    with ProgressDisplay(definition.name) as progress:
        outcome = execute_campaign(
            definition, out, scheduler=scheduler, workers=workers, retry=retry, notes=console.print_notes,
            progress=progress,
        )  # fmt: skip
    summary = summarize(outcome)
    print(json.dumps(summary, indent=1, ensure_ascii=False) if as_json else "\n".join(_lines(summary)))
    if site:
        from gyrobench.campaign.site.site_folder import write_site

        written = write_site(outcome.campaign, language=language)
        if not as_json:
            print("", *written.answer, display_path(written.index), sep="\n")
    if certificate:
        from gyrobench.campaign.site.lot_certificate import certify_campaign

        paths = certify_campaign(outcome.campaign)
        print(*([] if as_json else map(display_path, paths)), sep="\n")
    bad = {"fail", "void", "inconclusive"} & summary["verdicts"].keys()
    return not bad and summary["states"].keys() <= {"done"}


def summarize(outcome: CampaignOutcome) -> dict[str, Any]:
    """Return counts of states, verdicts and reasons, and of each quantity its mean and spread."""
    frame = outcome.campaign.table()
    states = frame["state"].value_counts().to_dict()
    reasons = {
        state: frame.loc[frame["state"] == state, "reason"].value_counts().head(REASONS).to_dict()
        for state in states
        if state != "done"
    }
    quantities = []
    for column in [c for c in frame.columns if c.endswith(".estimate")]:
        name = column.removesuffix(".estimate")
        own = frame[frame[column].notna()]
        entry: dict[str, Any] = {
            "name": name, "unit": outcome.campaign.units.get(column, ""), "runs": len(own),
            "mean": float(own[column].mean()), "u": float(own[f"{name}.u"].mean()),
            "std": float(own[column].std()) if len(own) > 1 else None,
        }  # fmt: skip
        known = own[own[f"{name}.truth"].notna()]
        if len(known):
            held = (known[f"{name}.lo"] <= known[f"{name}.truth"]) & (known[f"{name}.truth"] <= known[f"{name}.hi"])
            entry |= {"with_truth": len(known), "held": int(held.sum())}
        quantities.append(entry)
    return {
        "campaign": outcome.campaign.url,
        "runs": len(frame),
        "executed": outcome.executed,
        "stored_before": outcome.stored,
        "equal_points": outcome.repeated,
        "states": states,
        "reasons": reasons,
        "verdicts": frame["verdict"].dropna().value_counts().to_dict(),
        "quantities": quantities,
        "notes": outcome.notes,
    }


def _lines(summary: dict[str, Any]) -> list[str]:
    from gyrobench.report.plain_text import align_columns

    counts = ", ".join(f"{n:,} {state}" for state, n in summary["states"].items())
    before = f" ({summary['stored_before']:,} were stored before)" if summary["stored_before"] else ""
    lines = [f"{summary['runs']:,} runs: {counts}{before}"]
    if summary["equal_points"]:
        words = "point of the plan is" if summary["equal_points"] == 1 else "points of the plan are"
        lines.append(f"{summary['equal_points']:,} {words} the run of another point")
    if summary["verdicts"]:
        lines.append("verdicts: " + ", ".join(f"{n:,} {v}" for v, n in summary["verdicts"].items()))
    for state, reasons in summary["reasons"].items():
        lines += [f"{state}, {n:,}: {reason}" for reason, n in reasons.items()]
    if summary["quantities"]:
        rows = [["", "unit", "runs", "mean", "std of estimates", "mean u", "interval contains the true value"]]
        for q in summary["quantities"]:
            spread = f"{q['std']:.3g}" if q["std"] is not None else ""
            held = f"{q['held'] / q['with_truth']:.3f} of {q['with_truth']:,}" if "held" in q else ""
            rows.append([q["name"], q["unit"], f"{q['runs']:,}", f"{q['mean']:.6g}", spread, f"{q['u']:.3g}", held])
        lines += ["", *align_columns(rows, {0, 1})]
    url = summary["campaign"]
    return [*lines, *summary["notes"], "", url if "://" in url else display_path(Path(url))]


def require_over(over: Sequence[str] | None, seeds: int, data: str | None, table: Path | None) -> list[str]:
    """Return the axes.  Raises UsageError where nothing is varied."""
    if not over and seeds == 1 and data is None and table is None:
        raise UsageError(
            "nothing is varied: --over latitude=0deg..80deg:9, --seeds 100, --table FILE or --data 'lot/*.csv'"
        )
    return list(over or [])
