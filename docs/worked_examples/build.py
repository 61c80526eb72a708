"""Makes docs/worked_examples.md:  python docs/worked_examples/build.py [--write]

Every worked number of the four sources, beside what the bench gives.  Without --write: exit code 1 where the page
differs.  What a row says follows from its two numbers; a row that contradicts them stops the making.
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Callable
from pathlib import Path

HERE = Path(__file__).parent
PAGE = HERE.parent / "worked_examples.md"
sys.path.insert(0, str(HERE))
import hu_gyros  # noqa: E402
import hu_tables  # noqa: E402
import others  # noqa: E402
from example import Example  # noqa: E402

PART = re.compile(r"(<!--table (\w+)-->\n).*?(<!--end table-->)", re.S)
#: table -> source, its rows
TABLES: dict[str, tuple[str, Callable[[], list[Example]]]] = {
    "hu_gyros": ("Hu 1981, chapters 1 to 4", hu_gyros.examples),
    "hu_tables": ("Hu 1981, chapters 5 and 6", hu_tables.examples),
    "xia": ("Xia 2008", lambda: [*others.statistics_of_drift(), *others.models()]),
    "dong": ("Dong 2014", others.accelerometers),
    "gsp": ("GSP ch. 5", others.stabilizers),
}
HEAD = ("place", "quantity", "printed", "unit", "bench", "by", "verdict")


def shown(found: float) -> str:
    """Return a number of the bench with more digits than most sources print."""
    return "–" if math.isnan(found) else f"{found:.6g}"


def table(rows: list[Example]) -> str:
    """Return a Markdown table."""
    lines = [HEAD, ("---",) * len(HEAD)]
    lines += [(e.place, e.what, e.printed, e.unit, shown(e.found), e.by, e.verdict()) for e in rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def counts(tables: dict[str, list[Example]]) -> str:
    """Return how many numbers have which verdict, by source."""
    kinds = ("agrees", "misprint", "not reproducible")
    lines = [("source", *kinds), ("---",) * 4]
    for name, rows in tables.items():
        said = [e.verdict() for e in rows]
        lines.append((TABLES[name][0], *(str(sum(s.startswith(k) for s in said)) for k in kinds)))
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def made() -> dict[str, str]:
    """Return every table of the page by name."""
    rows = {name: of() for name, (_, of) in TABLES.items()}
    return {"counts": counts(rows), **{name: table(r) for name, r in rows.items()}}


def main() -> int:
    """Compare the page, or write it."""
    tables, old = made(), PAGE.read_text(encoding="utf-8")
    new = PART.sub(lambda m: m[1] + tables[m[2]] + m[3], old)
    if "--write" in sys.argv[1:]:
        PAGE.write_text(new, encoding="utf-8")
    elif new != old:
        print("docs/worked_examples.md differs; run: python docs/worked_examples/build.py --write")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
