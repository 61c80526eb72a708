"""Commands by form, and FMUs of other tools, in headless Chromium."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path
from typing import Any

import foreign_fmus
import numpy as np
import pytest
from studio_pages import CHROMIUM, NONE, TESTS, base_of, run_of, soon

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason=NONE)


def filled(page: Any, fields: dict[str, str], command: str) -> None:
    """Fill fields by their labels, see the command, start it, and wait for its end."""
    for label, text in fields.items():
        page.get_by_label(label).fill(text)
    page.wait_for_function("t => document.querySelector('.code')?.textContent.startsWith(t)", arg=command)
    page.get_by_role("button", name="Start").click()
    page.wait_for_url("**/job/**")
    page.wait_for_function("['done', 'failed'].includes(document.querySelector('[role=status]')?.textContent)")


@pytest.mark.long
def test_a_loop_is_tuned_by_a_form(page: Any, studio: tuple[str, Path]) -> None:
    """What the command prints stands on the page, its figures are one click away."""
    page.goto(base_of(studio) + "/tune?system=platform_single_axis")
    filled(
        page, {"Wanted, one a line": "phase margin=40deg\nbandwidth>10Hz"},
        "gyrobench tune platform_single_axis '--want=phase margin=40deg' '--want=bandwidth>10Hz'",
    )  # fmt: skip
    text = page.locator(".printed").text_content()
    assert "phase margin" in text and "--set stabilizer." in text, text
    page.get_by_role("link", name="Its pages").click()
    page.frame_locator("iframe.report").get_by_text("phase margin", exact=False).first.wait_for()


def loop_record(file: Path) -> None:
    """Write four periods of a multisine on K / (J s) with K = 60, J = 2: crossover 30 rad/s, 90 deg of margin."""
    h, K, J, rng = 1e-3, 60.0, 2.0, np.random.default_rng(3)
    t = h * np.arange(8000)
    lines = np.arange(1, 60, 2)  # of 0.5 Hz
    r = np.cos(np.pi * lines[:, None] * t + rng.uniform(0.0, 2.0 * np.pi, (len(lines), 1))).sum(axis=0)
    rate, rows = 0.0, []
    for k in range(len(t)):
        u = r[k] - K * (rate + 1e-5 * rng.standard_normal())
        rows.append((t[k], r[k], u, rate))
        rate += h * u / J
    head = "time [s],excitation [N.m],input [N.m],output [rad/s]"
    np.savetxt(file, rows, delimiter=",", header=head, comments="", fmt="%.9g")


@pytest.mark.long
def test_a_loop_is_identified_from_its_dropped_record(page: Any, studio: tuple[str, Path], tmp_path: Path) -> None:
    """|K / (J s)| = 1 at 30 rad/s = 4.775 Hz; held for a sample of 1 ms the phase there is -90 - 0.86 deg."""
    loop_record(tmp_path / "loop.csv")
    page.goto(base_of(studio) + "/identify")
    page.locator("input[type=file]").set_input_files(tmp_path / "loop.csv")
    page.wait_for_url("**/identify?file=**")
    filled(page, {"Frequencies to look at": "0.5Hz..30Hz"}, "gyrobench identify reports/out/studio/files/")
    text = page.locator(".printed").text_content() or ""
    assert re.search(r"phase margin +\|? *8[89]\.\d", text), text
    page.get_by_role("link", name="Its pages").click()
    page.frame_locator("iframe.report").get_by_text("phase margin", exact=False).first.wait_for()


def test_what_a_command_refuses_is_said(page: Any, studio: tuple[str, Path]) -> None:
    page.goto(base_of(studio) + "/tune?system=platform_single_axis")
    filled(page, {"Wanted, one a line": "beauty=3"}, "gyrobench tune platform_single_axis --want=beauty=3")
    assert page.get_by_role("status").text_content() == "failed"
    assert "beauty" in (page.locator(".printed").text_content() or "")


def test_a_refused_command_leads_back_to_its_form_filled_in(page: Any, studio: tuple[str, Path]) -> None:
    """Lists of several lines, a choice, the loop of a system that has several, characters of an address."""
    query = "system=platform_three_axis&want=beauty%3D3&want=bandwidth%3E10Hz&over=platform.J%3D%C2%B130%25"
    page.goto(f"{base_of(studio)}/tune?{query}&structure=pi&loop=azimuth")
    line = "gyrobench tune platform_three_axis --want=beauty=3 '--want=bandwidth>10Hz' '--over=platform.J=±30%' "
    filled(page, {}, line + "--loop=azimuth --structure=pi")
    page.get_by_role("link", name="Change its values").click()
    page.wait_for_url("**/tune?**")
    soon(lambda: page.get_by_label("Wanted, one a line").input_value(), "beauty=3\nbandwidth>10Hz")
    assert page.get_by_label("Spread of the parts, one a line").input_value() == "platform.J=±30%"
    page.wait_for_function("t => document.querySelector('.code')?.textContent.startsWith(t)", arg=line)
    assert "--loop=azimuth --structure=pi" in (page.locator(".code").first.text_content() or "")


@pytest.mark.long
def test_a_campaign_is_watched_and_its_site_opened(page: Any, studio: tuple[str, Path]) -> None:
    page.goto(base_of(studio) + "/campaign?system=fixed_position")
    fields = {"Varied, all combinations, one a line": "latitude=10deg,50deg", "Seeds at each point": "2",
              "Other values, one a line": "dwell=60s"}  # fmt: skip
    filled(page, fields, "gyrobench sweep fixed_position --over=latitude=10deg,50deg --seeds=2 --set=dwell=60s")
    assert "4 runs: 4 done" in (page.locator(".printed").text_content() or ""), page.locator(".printed").text_content()
    page.get_by_role("link", name="Its pages").click()
    with page.context.expect_page() as opened:
        page.get_by_role("link", name="site/index.html").click()
    opened.value.get_by_text("fixed_position", exact=False).first.wait_for()


@pytest.mark.long
def test_a_profile_is_kept_and_a_certificate_made(page: Any, studio: tuple[str, Path], two_runs: list[Path]) -> None:
    page.goto(base_of(studio) + "/laboratory")
    page.get_by_label("Name", exact=True).fill('Labor "Nord"')
    page.get_by_label("Address, one line each").fill("Street 1\n12345 Town")
    page.get_by_label("Signatories, ROLE: NAME, one a line").fill("Head: A. B.")
    page.get_by_label("Country, two letters").fill("Germany")
    page.get_by_role("button", name="Save").click()
    page.locator(".q-notification").get_by_text(re.compile("country")).wait_for()
    page.get_by_role("button", name="Close").click()
    assert not (studio[1] / "laboratory.toml").exists(), "what is wrong is not kept"
    page.get_by_label("Country, two letters").fill("DE")
    page.get_by_role("button", name="Save").click()
    page.get_by_text("Saved:").wait_for()
    profile = tomllib.loads((studio[1] / "laboratory.toml").read_text(encoding="utf-8"))
    assert profile["name"] == 'Labor "Nord"' and profile["country"] == "DE"
    assert profile["signatories"] == [{"role": "Head", "name": "A. B."}]
    page.goto(base_of(studio) + "/laboratory")
    soon(lambda: page.get_by_label("Name", exact=True).input_value(), 'Labor "Nord"')
    page.get_by_label("Run of an instrument, runs of a lot").click()
    page.get_by_role("option", name="fixed_position/run1").click()
    page.keyboard.press("Escape")
    page.get_by_label("Number of the certificate").fill("2026-7")
    page.wait_for_function("document.querySelector('.code')?.textContent.includes('--number=2026-7')")
    page.get_by_role("button", name="Make the certificate").click()
    page.get_by_role("link", name="Its pages").click()
    page.frame_locator("iframe.report").get_by_text("2026-7").first.wait_for()


@pytest.mark.long
def test_an_fmu_of_another_tool_is_dropped_on_a_slot(page: Any, studio: tuple[str, Path], tmp_path: Path) -> None:
    """The proposed mapping is shown, what the vendor's data sheet says is written into it, and the run has the gyro."""
    fmu = foreign_fmus.make("vendor_gyro", tmp_path)
    page.goto(base_of(studio) + "/system/fixed_position")
    page.get_by_label("dwell", exact=True).fill("60s")
    page.get_by_role("button", name="Parameters of gyro").click()
    page.locator('[aria-label="FMU for gyro"] input[type=file]').set_input_files(fmu)
    mapping = page.get_by_label("Mapping")
    assert "into the socket SdfGyro" in mapping.input_value()
    page.wait_for_function("document.querySelector('.code')?.textContent.includes('--map gyro=')")
    mapping.fill((TESTS / "foreign" / "vendor_gyro.toml").read_text(encoding="utf-8"))
    page.get_by_role("button", name="Run").click()
    run = json.loads((run_of(page, studio[1]) / "run.json").read_text())
    assert "RIG-7" in json.dumps(run["parts"]["gyro"]), run["parts"]["gyro"]


def test_of_several_loops_one_is_chosen(page: Any, studio: tuple[str, Path]) -> None:
    """Without it the command would be refused once it runs; a system with one loop has nothing to choose."""
    page.goto(base_of(studio) + "/tune?system=platform_four_gimbal")
    page.get_by_label("Loop", exact=True).wait_for()
    code = page.locator(".code").first
    soon(lambda: "--loop=pitch" in (code.text_content() or ""), True)
    page.get_by_label("Loop", exact=True).click()
    page.get_by_role("option", name="azimuth").click()
    soon(lambda: "--loop=azimuth" in (code.text_content() or ""), True)
    page.get_by_label("System", exact=True).fill("platform_single_axis")
    page.get_by_role("option", name="platform_single_axis").click()
    soon(lambda: "tune platform_single_axis" in (code.text_content() or ""), True)
    assert "--loop" not in (code.text_content() or "") and not page.get_by_label("Loop", exact=True).is_visible()
