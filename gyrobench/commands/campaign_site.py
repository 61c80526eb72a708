"""The site of a campaign and the comparison of two, from the command line."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from gyrobench.bench import Bench, UsageError, display_path


def write(url: str, out: Path | None, publish: Path | None, language: str) -> None:
    """Write the site, print what it answers and where it is."""
    from gyrobench.campaign.execution.store import Campaign
    from gyrobench.campaign.site.site_folder import write_site
    from gyrobench.commands.console import print_notes

    campaign = Campaign.open(url)
    print_notes(campaign.notes)
    written = write_site(campaign, out, publish, language)
    for sentence in written.answer:
        print(sentence)
    print(display_path(written.index))


def are_campaigns(folders: Sequence[Path]) -> bool:
    """Return whether all folders are stored campaigns.  Raises UsageError where only some are."""
    found = [(f / "campaign.json").is_file() for f in folders]
    if any(found) and not all(found):
        other = next(f for f, campaign in zip(folders, found, strict=True) if not campaign)
        raise UsageError(f"{other}: not a campaign; a campaign is compared with a campaign, a run with a run")
    return any(found)


def compare(folders: Sequence[Path], out: Path | None, as_json: bool, language: str) -> None:
    """Write and print what the second campaign differs in from the first beyond chance.  Raises UsageError."""
    from gyrobench.campaign.analysis.campaign_comparison import compare_campaigns
    from gyrobench.campaign.execution.store import Campaign
    from gyrobench.campaign.site.campaign_comparison_page import write_comparison
    from gyrobench.commands.console import print_notes, print_report_files
    from gyrobench.workflow.run_comparison import comparison_folder

    if len(folders) != 2:
        raise UsageError(f"{len(folders)} campaigns; two are compared: gyrobench compare CAMPAIGN CAMPAIGN")
    campaigns = [Campaign.open(f) for f in folders]
    print_notes(note for campaign in campaigns for note in campaign.notes)
    doc = compare_campaigns(*campaigns)
    paths = write_comparison(doc, out or comparison_folder(folders), Bench.find().folder, language)
    print_report_files(paths, None if as_json else "\n".join(doc["answer"]))
