"""What each test of a rate gyro or an IMU says of a mistake in a laboratory's file:

    python tests/benchmarks/instrument_mistakes.py [TEST ...] [--write]

Each file is written from the equations (the writers of tests/systems), with one mistake, and reduced.  Said is

named        a reason or a refusal has the words of this mistake
withheld     nothing passes or fails, without them
asked for    nothing passes without arrangement = checked, and the mistake is in the list
harmless     no estimate is off by 3 u
not seen     none of these

--write puts the table into docs/mistakes_of_a_record.md.
"""

from __future__ import annotations

import math
import re
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from asked import asked
from instrument_sheets import SHEETS as EARLIER
from instrument_sheets import Columns, Mistake, Sheet
from sheets_of_rates import DRIFT_RECORD, SENSITIVITY, WARM_UP
from sheets_thermal import THERMAL

import gyrobench as gb
from gyrobench.errors import GyrobenchError
from gyrobench.result import Result

PAGE = Path(__file__).parents[2] / "docs" / "mistakes_of_a_record.md"
SHEETS = (*EARLIER, THERMAL, WARM_UP, SENSITIVITY, DRIFT_RECORD)
SERIOUS = ("error", "warning", "doubt")
CHECKED = "# arrangement = checked\n"


def reduced(s: Sheet, c: Columns, folder: Path, checked: bool) -> Result | str:
    """Return the result of a file with these columns, or what it was refused with."""
    lines = [",".join(f"{v:.12g}" for v in row) for row in np.column_stack(list(c.values())).tolist()]
    head = f"{CHECKED if checked else ''}# type_b = none\n{s.head}{','.join(c)}\n"
    file = folder / "lab.csv"
    file.write_text(head + "\n".join(lines) + "\n", encoding="utf-8")
    try:
        return gb.reduce(s.system, file).result
    except GyrobenchError as error:
        return str(error)


def serious(result: Result) -> dict[str, str]:
    return {r.id: r.text for r in result.reasons if r.severity in SERIOUS}


def outcome(s: Sheet, m: Mistake, clean: Result, folder: Path) -> str:
    """Return what is said of a mistake."""
    c = {n: v.copy() for n, v in s.columns().items()}
    m.change(c)
    found = reduced(s, c, folder, True)
    if isinstance(found, str):
        return "named" if m.words and re.search(m.words, found) else "refused"
    new = {i: t for i, t in serious(found).items() if i not in serious(clean)}
    said = " ".join(new.values())
    if m.words and re.search(m.words, said):
        return "named"
    if any(r.id in new and r.blocks for r in found.reasons):
        return "withheld"
    asked = reduced(s, c, folder, False)
    text = serious(asked).get("arrangement.unstated", "") if isinstance(asked, Result) else str(asked)
    if m.words and re.search(m.words, text):
        return "asked for"
    before = {x.name: x for x in clean.coefficients}
    pairs = [(before[x.name], x) for x in found.coefficients if x.name in before]
    valued = [(a, b) for a, b in pairs if not (a.no_value or b.no_value)]
    far = any(abs(a.estimate - b.estimate) > 3.0 * math.hypot(a.u, b.u) for a, b in valued)
    return "not seen" if far or not m.words else "harmless"


def outcomes(s: Sheet) -> Iterator[tuple[Mistake, str]]:
    with tempfile.TemporaryDirectory() as folder:
        clean = reduced(s, s.columns(), Path(folder), True)
        if isinstance(clean, str):
            raise SystemExit(f"{s.name}: {clean}")
        for m in s.mistakes:
            yield m, outcome(s, m, clean, Path(folder))


def page(lines: list[str]) -> None:
    """Put the rows of the table into the page."""
    text = PAGE.read_text(encoding="utf-8")
    head, _, rest = text.partition("| --- | --- | --- | --- |\n")
    tail = rest.partition("\n\n")[2]
    PAGE.write_text(f"{head}| --- | --- | --- | --- |\n" + "\n".join(lines) + f"\n\n{tail}", encoding="utf-8")


def main() -> None:
    given = asked(__doc__, "tests", write=(False, "the table of all tests into the page"))
    lines = []
    for s in SHEETS:
        if not given.tests or s.name in given.tests:
            for m, said in outcomes(s):
                lines.append(f"| {s.name} | {m.kind} | {m.what} | {said} |")
                print(lines[-1], flush=True)
    if given.write and not given.tests:
        page(lines)


if __name__ == "__main__":
    main()
