"""Reports of stored runs in Chinese: what each lacks, and the English words that its PDF has.

    python tests/benchmarks/chinese_reports.py FOLDER [NAME ...]

FOLDER: of folders of runs, one a system, as ``gyrobench run NAME --out FOLDER/NAME`` makes them; NAME: of these alone.
Nothing is written into them.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1] / "support"))

from reading import pdf_text

from gyrobench.record.record import Record
from gyrobench.record.run_document import RecordError
from gyrobench.report import load, write
from gyrobench.report.language import WORD, UntranslatedError, catalogue
from gyrobench.report.report_files import own_texts
from gyrobench.report.result_json import Report


def words_left(folder: Path) -> set[str]:
    """Return the English words of the report of a run in Chinese that are neither names nor texts of the user.

    Raises UntranslatedError.
    """
    result = load((folder / "result.json").read_text())
    try:
        channels = Record.load(folder).channels
    except RecordError:  # of a suite, whose tests have the records
        channels = {}
    with tempfile.TemporaryDirectory() as name:
        text = pdf_text(write(result, name, ("pdf",), channels or None, language="zh")["pdf"])
    own, names = own_texts(Report.of(result))
    allowed = catalogue("zh").names | {word for t in own | names for word in t.split()}
    return set(WORD.findall(text)) - allowed


def main(root: Path, *names: str) -> int:
    whole = 0
    runs = sorted(f.parent for f in root.glob("*/result.json") if not names or f.parent.name in names)
    for folder in runs:
        try:
            left = words_left(folder)
            whole += 1
            print(f"{folder.name}: whole; {' '.join(sorted(left))}", flush=True)
        except UntranslatedError as error:
            print(f"{folder.name}: {error}", flush=True)
    print(f"{whole} of {len(runs)} reports are whole")
    return whole < len(runs)


if __name__ == "__main__":
    raise SystemExit(main(Path(sys.argv[1]), *sys.argv[2:]))
