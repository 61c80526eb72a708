"""How fast the site of a campaign is written and opens: 10, 1000 and 10,000 runs at 1280 and 390 px.

    python tests/benchmarks/campaign_site.py FOLDER

Synthetic campaigns of three coefficients with known truth (tests/campaign/synthetic_campaign.py).  Opening is counted
from the address to the load event and the first frame after it, in headless Chromium, best of three; console messages,
requests to the network and labels of figures that lie on each other are counted too.  FOLDER keeps sites and pictures;
without it they go.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

import synthetic_campaign as synthetic
from browser import OVERLAPS, Browser

from gyrobench.campaign.execution.store import Campaign
from gyrobench.campaign.site.site_folder import write_site


def main() -> int:
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        problems = 0
        print(f"{'runs':>7}{'written / s':>13}{'width / px':>12}{'opens / s':>11}{'complaints':>12}{'overlaps':>10}")
        with Browser(Path(temporary) / "profile") as browser:
            for runs in (10, 1000, 10_000):
                campaign = Campaign.open(synthetic.sweep(folder / f"runs_{runs}", runs))
                began = time.monotonic()
                page = write_site(campaign).index
                written = time.monotonic() - began
                for width in (1280, 390):
                    browser.console.clear()
                    opens = min(browser.open(page, width) for _ in range(3))
                    overlaps = len(browser.run(OVERLAPS))
                    print(f"{runs:>7}{written:>13.1f}{width:>12}{opens:>11.2f}{len(browser.console):>12}{overlaps:>10}")
                    browser.picture(folder / f"runs_{runs}_{width}.png")
                    problems += bool(browser.console) + bool(overlaps) + (opens > 2.0)
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
