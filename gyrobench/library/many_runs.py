"""Campaigns and sweeps from Python."""

from __future__ import annotations

import contextlib
import uuid
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gyrobench.boundary import checked
from gyrobench.library.experiment import File, path_of
from gyrobench.report.language import ENGLISH

if TYPE_CHECKING:
    import pandas
    from distributed import Client

    from gyrobench.campaign.execution.campaign_execution import CampaignProgress
    from gyrobench.campaign.execution.definition import Definition
    from gyrobench.campaign.site.site_folder import CampaignSite


@checked
def campaign(
    definition: File | Mapping[str, Any],
    *,
    out: File | None = None,
    client: Client | None = None,
    scheduler: str | None = None,
    workers: int | None = None,
    retry: bool = False,
    progress: Callable[[CampaignProgress], None] | None = None,
) -> pandas.DataFrame:
    """Run what is not done yet of a campaign; return a row for each run, ``attrs["units"]`` with the units.

    definition: a TOML file, or a dictionary with its keys (see gyrobench.campaign.execution.definition).  out: folder
    or URL that keeps the rows; without it nothing is written.  client: of dask; else the one of a scheduler at an
    address, the current one of a notebook, or ``workers`` local processes.  retry: run again what crashed or hung.
    progress: called twice a second.  Columns: see gyrobench.campaign.execution.store.  Raises errors of type
    GyrobenchError.
    """
    from gyrobench.campaign.execution.definition import from_mapping, read_definition

    asked = from_mapping(definition) if isinstance(definition, Mapping) else read_definition(Path(definition))
    return _executed(asked, out or asked.out, client, scheduler, workers, retry, progress)


@checked
def sweep(
    system: str,
    over: Mapping[str, Any] | None = None,
    *,
    seeds: Any = 1,
    out: File | None = None,
    client: Client | None = None,
    scheduler: str | None = None,
    workers: int | None = None,
    progress: Callable[[CampaignProgress], None] | None = None,
    **more: Any,
) -> pandas.DataFrame:
    """Run a system over values of its options and parameters; return a row for each run.

        gb.sweep("...", {"latitude": "0deg..80deg:9", "gyro.D_I": [0.1, 0.3]}, seeds=100, set={"turns": 2})

    over: axis -> values as gyrobench.campaign.execution.axes reads them.  more: further keys of a campaign (set,
    parts, runs, design, table, data, keep ...).  The rest is as of :func:`campaign`.
    """
    from gyrobench.campaign.execution.definition import from_mapping

    asked = from_mapping({"system": system, "over": dict(over or {}), "seeds": seeds, **more}, where="sweep")
    return _executed(asked, out, client, scheduler, workers, False, progress)


@checked
def site(
    campaign: File, out: File | None = None, *, publish: File | None = None, language: str = ENGLISH
) -> CampaignSite:
    """Write the site of a stored campaign; ``.index`` is its page, ``.answer`` the sentences with which it opens.

    campaign: folder or URL, the ``out`` of :func:`campaign` or :func:`sweep`.  out: folder of the site, default
    ``site`` in the campaign.  publish: a folder that shall hold everything, reports included.  language: of the page,
    en or zh.  Raises errors of type GyrobenchError.
    """
    from gyrobench.campaign.execution.store import Campaign
    from gyrobench.campaign.site.site_folder import write_site

    return write_site(Campaign.open(campaign), path_of(out), path_of(publish), language)


def _executed(
    definition: Definition,
    out: File | None,
    client: Client | None,
    scheduler: str | None,
    workers: int | None,
    retry: bool,
    progress: Callable[[CampaignProgress], None] | None,
) -> pandas.DataFrame:
    from gyrobench.campaign.execution.campaign_execution import execute_campaign

    with _store(out) as url:
        outcome = execute_campaign(
            definition, url, client=client, scheduler=scheduler, workers=workers, retry=retry, progress=progress
        )
        return outcome.campaign.table()


@contextlib.contextmanager
def _store(out: File | None) -> Iterator[str]:
    """Yield where the rows go: without a place in memory, and nowhere after the call."""
    if out is not None:
        yield str(out)
        return
    import fsspec

    url = f"memory://gyrobench-{uuid.uuid4().hex}"
    try:
        yield url
    finally:
        fs, path = fsspec.core.url_to_fs(url)
        with contextlib.suppress(FileNotFoundError):
            fs.rm(path, recursive=True)
