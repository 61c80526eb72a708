"""Certificates from the folders of runs: only of reports that are as they were written."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from gyrobench import reading
from gyrobench.bench import Bench, UsageError
from gyrobench.files import sha256, write_whole
from gyrobench.record.run_document import RecordError
from gyrobench.report import calibration_certificate, certificate_page, load, render
from gyrobench.report.certificate_page import Certified, Charts
from gyrobench.report.laboratory import FILE, Laboratory, read_laboratory
from gyrobench.report.language import check_code
from gyrobench.report.result_json import Report
from gyrobench.workflow.inputs import require_run
from gyrobench.workflow.manifest import verify
from gyrobench.workflow.run_folders import MANIFEST


def write_certificate(
    runs: Sequence[Path],
    profile: Path | None = None,
    number: str = "",
    out: Path | None = None,
    language: str = "",
    digital: bool = False,
    charts: Charts | None = None,
) -> list[Path]:
    """Write ``certificate-NUMBER.html`` and ``.pdf`` of runs of one test; return their paths.

    profile: of the laboratory, default ``laboratory.toml`` here or in the bench; out: default the working folder.
    language: default that of the profile.  digital: ``certificate-NUMBER.xml``, too, a Digital Calibration Certificate.
    charts: of a lot, drawn in the language of the certificate.  Raises VerificationError for a report that was changed,
    UsageError for runs of different tests, a run twice and a wrong profile.
    """
    bench = Bench.find().folder
    laboratory = find_laboratory(profile)
    of = []
    for folder in runs:
        verify(require_run(folder))
        result = load(reading.read_text(folder / "result.json", RecordError))
        of.append(Certified(Report.of(result), sha256(folder / MANIFEST)))
    digests = [one.digest for one in of]
    if twice := [folder for folder, digest in zip(runs, digests, strict=True) if digests.count(digest) > 1]:
        raise UsageError(f"certificate: {twice[0]} and {twice[1]} are one report; a lot names each once")
    language = language and check_code(language)
    page = certificate_page.page(of, laboratory, number, language, bench, charts)
    made = {"html": render.html(page, bench).encode(), "pdf": render.pdf(page, bench)}
    if digital:
        made["xml"] = _digital(of, laboratory, number, language, bench, made["pdf"])
    target = out or Path()
    target.mkdir(parents=True, exist_ok=True)
    paths = [target / f"certificate-{reading.visible(page.report_id).replace('/', '-')}.{kind}" for kind in made]
    for path, content in zip(paths, made.values(), strict=True):
        write_whole(path, content)
    return paths


def find_laboratory(profile: Path | None = None) -> Laboratory:
    """Return a profile, default ``laboratory.toml`` here or in the bench.  Raises UsageError for none, a wrong one."""
    there = [file for file in (Path(FILE), Bench.find().folder / FILE) if file.is_file()]
    return read_laboratory(profile or (there[0] if there else Path(FILE)))


def _digital(
    of: Sequence[Certified], laboratory: Laboratory, number: str, language: str, bench: Path, pdf: bytes
) -> bytes:
    with certificate_page.spoken(of, laboratory, number, language, bench) as words:
        code = language or laboratory.language
        number = number or certificate_page.number_of(of)
        return calibration_certificate.xml(of, laboratory, number, pdf, code, words.find if words else None)
