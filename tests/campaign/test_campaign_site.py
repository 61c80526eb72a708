"""The site of a campaign: its numbers, its files, and its page in a real browser, by mouse and by keyboard."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import synthetic_campaign as synthetic
from browser import OVERLAPS, Browser, needs_chromium
from commanding import Command

import gyrobench as gb
from gyrobench.bench import UsageError
from gyrobench.campaign.analysis.campaign_analysis import analyse
from gyrobench.campaign.analysis.measures import numbers
from gyrobench.campaign.execution.store import Campaign, CampaignError, CampaignStore
from gyrobench.campaign.site.site_folder import write_site

RUNS = 300


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A campaign of 300 runs with its site; run 0 has a report."""
    found = synthetic.sweep(tmp_path_factory.mktemp("campaign") / "sweep", RUNS, reports=(0,))
    write_site(Campaign.open(found))
    return found


@pytest.fixture(scope="module")
def page(folder: Path) -> Path:
    return folder / "site" / "index.html"


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with Browser(tmp_path_factory.mktemp("browser") / "profile") as opened:
        yield opened


# ------------------------------------------------------------------------------------------------- numbers
@pytest.mark.long
def test_the_answer_says_what_was_put_into_the_runs(page: Path) -> None:
    doc = json.loads((page.parent / "analysis.json").read_text())
    text = " ".join(doc["answer"])
    assert doc["question"] == "Where does the latitude spoil the fixed drift?"
    assert re.search(r"\d+ of 300 runs have a result; \d+ refused, 1 hung", text)
    assert "not consistent with 0.95: D_I, D_S" in text
    assert "latitude changes u of D_F beyond chance" in text
    assert "dwell changes the error of D_I beyond chance" in text
    assert [(f["state"], f["reason"][:4]) for f in doc["failures"]] == [("refused", "rate"), ("hung", "no p")]
    assert "by dwell: D_I" in text and "by latitude: u of D_F" in text


def test_every_number_on_the_page_is_the_one_in_its_document(page: Path) -> None:
    doc = json.loads((page.parent / "analysis.json").read_text())
    shown = re.findall(r'data-value="([^"]*)" data-pointer="([^"]*)"', page.read_text(encoding="utf-8"))
    assert len(shown) > 80
    for value, pointer in shown:
        found = doc
        for key in pointer.strip("/").split("/"):
            found = found[int(key)] if isinstance(found, list) else found[key]
        assert float(value) == float(found), pointer


def test_coverage_is_counted_by_the_intervals(folder: Path) -> None:
    rows = Campaign.open(folder).table()
    doc = json.loads((folder / "site" / "analysis.json").read_text())
    done = rows[rows["state"] == "done"]
    for c in doc["coverage"]:
        truth = numbers(done, f"{c['name']}.truth")
        hits = (numbers(done, f"{c['name']}.lo") <= truth) & (truth <= numbers(done, f"{c['name']}.hi"))
        assert (c["hits"], c["runs"]) == (hits.sum(), len(done))


def test_rows_go_out_with_full_precision_and_units(folder: Path) -> None:
    rows = Campaign.open(folder).table()
    with (folder / "site" / "runs.csv").open(newline="") as file:
        listed = list(csv.DictReader(file))
    assert len(listed) == RUNS
    assert float(listed[7]["D_F.estimate [°/h]"]) == rows["D_F.estimate"][7]
    assert float(listed[7]["in.dwell [min]"]) == rows["in.dwell"][7]


# --------------------------------------------------------------------------------------------------- files
@pytest.mark.long
def test_reports_are_linked_in_the_campaign_and_published_with_the_site(folder: Path, tmp_path: Path) -> None:
    assert '"../kept/0000000000000000/report.html"' in (folder / "site" / "runs.js").read_text()
    public, small = tmp_path / "public", synthetic.sweep(tmp_path / "small", 4, reports=(0,))
    write_site(Campaign.open(small), publish=public)
    assert '"kept/0000000000000000/report.html"' in (public / "runs.js").read_text()
    assert (public / "kept/0000000000000000/report.html").read_text() == "report 0"
    (public / "kept" / "gone").mkdir()
    write_site(Campaign.open(small), publish=public)  # again, and what is no longer kept goes
    assert [p.name for p in (public / "kept").iterdir()] == ["0000000000000000"]


def test_a_folder_of_something_else_is_not_touched(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(UsageError, match="holds other files"):
        write_site(Campaign.open(folder), publish=tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["mine.txt"]


@pytest.mark.long
def test_command_prints_the_answer(command: Command, tmp_path: Path) -> None:
    small = synthetic.sweep(tmp_path / "small", 6)
    code, out, _ = command("site", small, "--out", tmp_path / "site")
    assert code == 0
    assert "of 6 runs have a result" in out
    assert (tmp_path / "site" / "index.html").is_file()
    assert command("site", tmp_path / "nothing")[0] == 3
    assert command("site", small, "--out", "a", "--publish", "b")[0] == 2


@pytest.mark.long
def test_a_site_from_python_is_that_of_the_command(tmp_path: Path) -> None:
    small = synthetic.sweep(tmp_path / "small", 6)
    made = gb.site(small)
    assert made.index == small / "site" / "index.html" and "of 6 runs have a result" in made.answer[0]
    assert gb.site(str(small), publish=tmp_path / "public").index.read_text() == made.index.read_text()
    with pytest.raises(gb.GyrobenchError, match="no campaign there"):
        gb.site(tmp_path)
    with pytest.raises(UsageError, match="name one"):
        gb.site(small, "a", publish="b")


# ------------------------------------------------------------------------------------------------- browser
ROWS = "Array.from(document.querySelectorAll('#runs-rows tbody tr'), r => Array.from(r.cells, c => c.textContent))"
HEADS = "Array.from(document.querySelectorAll('#runs-rows th'), h => h.textContent)"
STATUS = "document.getElementById('runs-status').textContent"
FOCUS = "document.activeElement.textContent || document.activeElement.id"


def column(browser: Browser, name: str) -> list[str]:
    k = next(i for i, head in enumerate(browser.run(HEADS)) if head.split(" / ")[0] == name)
    return [row[k] for row in browser.run(ROWS)]


@needs_chromium
@pytest.mark.parametrize("width", [390, 1280])
@pytest.mark.long
def test_page_opens_from_disk_without_complaint(browser: Browser, page: Path, width: int) -> None:
    browser.console.clear()
    browser.open(page, width)
    assert browser.console == []  # no error, no warning, nothing from the network
    assert browser.run("innerWidth") == width
    assert browser.run("document.documentElement.scrollWidth") <= width
    assert browser.run(STATUS) == f"1 to 50 of {RUNS} runs."
    outside = "Array.from(document.querySelectorAll('main p, main h2, main input, main button'), e => "
    outside += "e.closest('.scroll') ? 0 : e.getBoundingClientRect().right).filter(x => x > innerWidth + 1)"
    assert browser.run(outside) == []
    small = "Array.from(document.querySelectorAll('.picture svg'), s => s.getBoundingClientRect().width)"
    assert min(browser.run(small)) > 250  # drawn for 310: text of 8 pt stays legible
    browser.run("document.querySelectorAll('details').forEach(d => d.open = true)")
    assert browser.run(OVERLAPS) == []


@needs_chromium
@pytest.mark.long
def test_complaints_would_be_seen(browser: Browser, page: Path, tmp_path: Path) -> None:
    broken = tmp_path / "broken.html"
    script = "<script>missing()</script><img src='http://localhost:9/x.png'></main>"
    broken.write_text(page.read_text(encoding="utf-8").replace("</main>", script), encoding="utf-8")
    browser.console.clear()
    browser.open(broken, 1280)
    assert any("missing" in c for c in browser.console) and any("network" in c for c in browser.console)


@needs_chromium
@pytest.mark.long
def test_table_filters_sorts_and_turns_pages_by_keyboard(browser: Browser, page: Path, folder: Path) -> None:
    rows = Campaign.open(folder).table()
    browser.open(page, 1280)
    browser.run("document.getElementById('runs-filter').focus()")
    browser.type("latitude>40 state=done")
    wait(browser, f"{STATUS}.includes('filtered')")
    inside = rows[(rows["in.latitude"] > 40.0) & (rows["state"] == "done")]
    assert browser.run(STATUS) == f"1 to 50 of {len(inside)} runs, filtered from {RUNS}."
    for _ in range(40):  # Tab leads to the headings
        browser.key("Tab")
        if browser.run(FOCUS).startswith("u(D_F)"):
            break
    browser.key("Enter")
    browser.key("Enter")  # largest first
    best = inside.sort_values("D_F.u", ascending=False)
    assert column(browser, "index") == [str(i) for i in best["index"].head(50)]
    assert browser.run("document.querySelector('th[aria-sort]').getAttribute('aria-sort')") == "descending"
    browser.run("document.querySelector('.pager button[aria-label=\"Next page\"]').focus()")
    browser.key(" ")
    assert column(browser, "index") == [str(i) for i in best["index"].iloc[50:100]]


@needs_chromium
@pytest.mark.long
def test_numbers_are_rounded_to_their_u_and_what_is_missing_comes_last(browser: Browser, page: Path) -> None:
    browser.open(page, 1280)
    failed = column(browser, "state").index("hung")
    assert column(browser, "D_F")[failed] == "–"
    values, us = column(browser, "D_I"), column(browser, "u(D_I)")
    assert us[0] == "0.020" and re.fullmatch(r"−?\d\.\d{3}", values[0])
    click(browser, "D_I")
    shown = [float(v.replace("−", "-")) for v in column(browser, "D_I")]
    assert shown == sorted(shown) and min(shown) < -2.0
    browser.run("document.getElementById('runs-columns').value = 'D_S'")
    browser.run("document.getElementById('runs-columns').dispatchEvent(new Event('change'))")
    heads = [h.split(" / ")[0] for h in browser.run(HEADS)]
    assert heads[-8:] == ["seed", "D_S", "u(D_S)", "lo(D_S)", "hi(D_S)", "truth(D_S)", "z(D_S)", "reason"]


@needs_chromium
@pytest.mark.long
def test_a_reason_leads_to_its_runs_and_a_mistake_is_named(browser: Browser, page: Path, folder: Path) -> None:
    rows = Campaign.open(folder).table()
    browser.open(page, 390)
    browser.run("document.querySelector('td a[href^=\"#filter\"]').click()")
    wait(browser, f"{STATUS}.includes('filtered')")
    assert set(column(browser, "state")) == {"refused"}
    assert len(column(browser, "state")) == (rows["state"] == "refused").sum()
    browser.run("document.getElementById('runs-filter').value = 'nothing<3'")
    browser.run("document.getElementById('runs-filter').dispatchEvent(new Event('input'))")
    wait(browser, f"{STATUS}.includes('no column nothing')")
    link = browser.run("document.querySelector('#runs-rows a').getAttribute('href')")
    assert (page.parent / link).is_file()


def click(browser: Browser, head: str) -> None:
    found = f"find(b => b.textContent.startsWith('{head} /'))"
    browser.run(f"Array.from(document.querySelectorAll('#runs-rows th button')).{found}.click()")


def wait(browser: Browser, condition: str) -> None:
    look = f"if ({condition}) {{ clearInterval(t); r(1); }}"
    browser.run(f"new Promise(r => {{ const t = setInterval(() => {{ {look} }}, 20); }})")


# ----------------------------------------------------------------------------------------------------- lot
@pytest.mark.parametrize("ids", [True, False], ids=["ids", "0.1.0"])
def test_what_the_whole_lot_warns_of_singles_out_nobody(tmp_path: Path, ids: bool) -> None:
    lot = synthetic.lot(tmp_path / "lot", 30, remark="Inconclusive instead of pass: D_{k}. State u_remount.", ids=ids)
    doc = analyse(Campaign.open(lot))
    assert [i["instrument"] for i in doc["lot"]["instruments"] if i["why"]] == ["gyro 3", "gyro 11", "gyro 20"]
    assert doc["lot"]["common"] == [{"warning": "Inconclusive instead of pass: D_0. State u_remount.", "runs": 29}]
    assert doc["lot"]["accepted"] == 27


@pytest.mark.long
def test_lot_of_measured_files(tmp_path: Path) -> None:
    """One torn, one inconclusive with its cause, one unlike the rest; the others are judged without them."""
    lot = synthetic.lot(tmp_path / "lot", 40)
    write_site(Campaign.open(lot))
    doc = json.loads((lot / "site" / "analysis.json").read_text())
    bad = {i["instrument"]: i["why"] for i in doc["lot"]["instruments"] if i["why"]}
    assert list(bad) == ["gyro 3", "gyro 11", "gyro 20"]
    assert bad["gyro 3"] == ["row 7: 3 cells, expected 5"]
    assert "exchanged mounts" in bad["gyro 11"][0]
    assert bad["gyro 20"][0].startswith("outlier: D_I is") and "above" in bad["gyro 20"][0]
    assert "3 of 40 measured files need attention: gyro 3, gyro 11, gyro 20." in doc["answer"]
    assert "The other 37: 37 pass." in doc["answer"]
    tolerance = doc["lot"]["tolerance"][1]
    assert (tolerance["name"], tolerance["n"]) == ("D_I", 37)
    assert tolerance["high"] < 3.0 * np.sqrt(1.0 + 0.02**2) + 1.0  # of a unit normal, not of the outlier at 9
    html = (lot / "site" / "index.html").read_text(encoding="utf-8")
    assert 'href="../kept/0000000000000014/report.html"' in html  # gyro 20, one click away


def foreign(tmp_path: Path, report: str, text: str = "lot") -> Campaign:
    """A campaign of others with one run, whose digests fit: who writes it can compute them."""
    rows = [
        {"run": "0", "index": 0, "system": "toy", "seed": 1, "state": "done", "reason": text, "a.estimate": 1.0,
         "report": report, "instrument": "one", "date": "2026-01-01", "verdict": "pass"}
    ]  # fmt: skip
    (tmp_path / "secret").mkdir()
    (tmp_path / "secret" / "report.html").write_text("mine")
    axes = [{"name": "data", "kind": "data", "unit": ""}]
    document = {"name": text, "question": "", "system": "toy", "axes": axes, "definition": {}, "options": {}}
    with CampaignStore(tmp_path / "c") as store:
        store.begin(document | {"parts": {}, "versions": {}}, {"0": {"index": 0}})
        store.append(rows, {"a.estimate": "°/h"})
    return Campaign.open(tmp_path / "c")


@pytest.mark.parametrize(
    "report",
    ["../secret/report.html", "kept/../../secret/report.html", "javascript:alert(1)//report.html", "kept/0/x.js"],
)
def test_a_foreign_campaign_neither_writes_outside_nor_brings_scripts(tmp_path: Path, report: str) -> None:
    campaign = foreign(tmp_path, report)
    for places in ((None, tmp_path / "out"), (tmp_path / "site", None)):
        with pytest.raises(CampaignError, match="not the place of a report of this campaign"):
            write_site(campaign, *places)
    assert {f.name for f in tmp_path.iterdir()} <= {"c", "secret", "site", "out"}
    assert not list((tmp_path / "out").rglob("*.html"))


def test_characters_that_turn_the_direction_of_a_text_are_shown(tmp_path: Path) -> None:
    """A name with which the page would show "fail" the other way round, and which clears a terminal."""
    campaign = foreign(tmp_path, "kept/0/report.html", "a\u202eliaf\x1b[2J")
    write_site(campaign, tmp_path / "site")
    for name in ("index.html", "runs.js"):
        page = (tmp_path / "site" / name).read_text(encoding="utf-8")
        assert "a⟨U+202E⟩liaf" in page and "\u202e" not in page and "\x1b" not in page, name


def test_no_file_of_a_site_has_the_folders_of_the_machine(tmp_path: Path) -> None:
    """Measured files by their places in the folder that holds all of them, files of a definition by their names."""
    machine = "/someone/Prüf stand/los"
    columns = {"data": [f"{machine}/{k % 2}/{k}.csv" for k in range(9)], "state": ["done"] * 8 + ["refused"]}
    columns["reason"] = [None] * 8 + [f"{machine}/0/8.csv: not usable"]
    columns["warnings"] = [[f"{machine}/{k % 2}/{k}.csv has an odd row."] for k in range(9)]
    columns |= synthetic.measure("D_F", np.arange(9.0), 1.0)
    more = {"axes": [{"name": "data", "kind": "data", "unit": ""}], "options": {"profile": f"{machine}/ride.csv"}}
    written = write_site(Campaign.open(synthetic.write(tmp_path / "c", columns, {}, **more)))
    files = {f.name: f.read_text(encoding="utf-8") for f in written.index.parent.iterdir()}
    assert len(files) == 6 and not [name for name, text in files.items() if "someone" in text]
    assert '"0/8.csv"' in files["runs.js"] and "0/8.csv: not usable" in files["index.html"]
    assert "ride.csv" in files["index.html"] and "\n1,,synthetic,1,1/1.csv," not in files["runs.csv"]
    assert "1/1.csv has an odd row." in files["runs.csv"]
