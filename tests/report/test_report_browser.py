"""The pages in headless Chromium: no console message, no sideways scrolling, no text over text."""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess

import pytest
from reading import Written

from gyrobench.report.assets import read_content

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))), None)
needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="no chromium on PATH: pages are not looked at")

PROBE = r"""
<script>
window.addEventListener("load", function () {
  document.querySelectorAll("details").forEach(function (d) { d.open = true; });
  document.querySelectorAll(".zoombar button:first-of-type").forEach(function (b) { b.click(); });
  var found = { width: innerWidth, page: document.documentElement.scrollWidth, wide: [], overlaps: [], ticks: 0 };
  function clipped(rect, node) {
    var r = { l: rect.left, t: rect.top, r: rect.right, b: rect.bottom };
    for (var box = node.closest(".scroll"); box; box = box.parentElement && box.parentElement.closest(".scroll")) {
      var c = box.getBoundingClientRect();
      r = { l: Math.max(r.l, c.left), t: Math.max(r.t, c.top), r: Math.min(r.r, c.right), b: Math.min(r.b, c.bottom) };
    }
    return r.r - r.l > 1 && r.b - r.t > 1 ? r : null;
  }
  function compare(items) {
    for (var i = 0; i < items.length; i++) {
      for (var j = i + 1; j < items.length; j++) {
        var a = items[i], b = items[j];
        if (Math.min(a.r, b.r) - Math.max(a.l, b.l) > 1.5 && Math.min(a.b, b.b) - Math.max(a.t, b.t) > 2.5) {
          found.overlaps.push([a.s, b.s]);
        }
      }
    }
  }
  var texts = [], walker = document.createTreeWalker(document.querySelector("main"), NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    var node = walker.currentNode, parent = node.parentElement;
    if (!node.data.trim() || parent.closest("script,style,svg")) { continue; }
    var range = document.createRange();
    range.selectNodeContents(node);
    Array.from(range.getClientRects()).forEach(function (rect) {
      var r = clipped(rect, parent);
      if (r) { r.s = node.data.trim().slice(0, 40); texts.push(r); }
      if (!parent.closest(".scroll") && rect.right > innerWidth + 0.5) { found.wide.push(node.data.trim()); }
    });
  }
  compare(texts);
  document.querySelectorAll(".picture svg").forEach(function (svg) {
    var labels = [];
    svg.querySelectorAll('g[id*="-text_"], g[id*="-spanlabel"], text').forEach(function (g) {
      var r = g.getBoundingClientRect();
      if (r.width > 0) { labels.push({ l: r.left, t: r.top, r: r.right, b: r.bottom, s: g.id || g.textContent }); }
    });
    compare(labels);
  });
  found.ticks = document.querySelectorAll("[data-zoom] svg text").length;
  window.parent.document.getElementById("probe").textContent = JSON.stringify(found);
});
</script>
</body>"""


# a window cannot be made as narrow as a phone, a frame can; its media queries see the width of the frame
FRAME = '<!doctype html><pre id="probe"></pre><iframe style="border:0" {size} srcdoc="{page}"></iframe>'


def look(page: str, folder, width: int, dark: bool = False) -> tuple[dict, str]:
    path = folder / f"probe-{width}.html"
    probed = html.escape(page.replace("</body>", PROBE))
    path.write_text(FRAME.format(size=f'width="{width}" height="900"', page=probed), encoding="utf-8")
    flags = [
        "--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--no-first-run",
        "--hide-scrollbars", f"--user-data-dir={folder / 'profile'}", "--window-size=1500,1000",
        "--enable-logging=stderr", "--virtual-time-budget=4000", "--dump-dom",
    ]  # fmt: skip
    if dark:
        flags.append("--blink-settings=preferredColorScheme=0")
    run = subprocess.run([CHROMIUM, *flags, path.as_uri()], capture_output=True, text=True, timeout=300, check=True)
    match = re.search(r'<pre id="probe">(.+?)</pre>', run.stdout, flags=re.S)
    assert match, run.stderr[-2000:]
    return json.loads(html.unescape(match.group(1))), run.stderr


@needs_chromium
@pytest.mark.parametrize("width", [390, 1280])
@pytest.mark.parametrize("which", ["written", "compared"])
@pytest.mark.long
def test_page_in_the_browser(which, width, request, tmp_path):
    page: Written = request.getfixturevalue(which)
    found, log = look(page.html, tmp_path, width)
    assert found["width"] == width
    assert "CONSOLE" not in log
    assert found["page"] <= width
    assert found["wide"] == []
    assert found["overlaps"] == []
    if which == "written":
        assert found["ticks"] >= 3  # one click on + drew new ticks


@needs_chromium
@pytest.mark.long
def test_a_console_error_would_be_seen(written, tmp_path):
    _, log = look(written.html.replace("</main>", "</main><script>missing();</script>"), tmp_path, 1280)
    assert "CONSOLE" in log


@needs_chromium
@pytest.mark.long
def test_an_overlap_would_be_seen(written, tmp_path):
    broken = written.html.replace("</style>", "dd { margin-top: -1.2rem !important; } h1 { width: 200vw; }</style>")
    found, _ = look(broken, tmp_path, 390)
    assert found["overlaps"]
    assert found["page"] > 390


def luminance(colour: str) -> float:
    parts = [int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5)]
    linear = [p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(a: str, b: str) -> float:
    high, low = sorted((luminance(a), luminance(b)), reverse=True)
    return (high + 0.05) / (low + 0.05)


def test_covers_of_a_table_have_the_ground_of_the_box_around_it() -> None:
    """What hides the shades of a table that does not go on was white in a verdict that is green."""
    css = read_content("templates/report.css")
    boxes = re.findall(r"^\.answer(?:\.\w+)?[^{]*\{([^}]*)\}", css, flags=re.M)
    grounds = [b for b in boxes if "border-left" in b]
    assert len(grounds) == 4 and all("--ground: var(--" in b for b in grounds)
    assert "var(--page) 40%" not in css and css.count("var(--ground) 40%") == 2


@pytest.mark.parametrize("theme", [0, 1])
def test_contrast_of_text_and_lines(theme):
    css = read_content("templates/report.css")
    colours = dict(re.findall(r"--([a-z]+): (#[0-9a-f]{6})", re.findall(r":root \{(.*?)\}", css, flags=re.S)[theme]))
    page = colours["page"]
    for name in ("ink", "muted", "link", "pass", "fail", "unsure"):
        assert contrast(colours[name], page) >= 4.5, name
    for box in ("card", "good", "bad", "doubt", "shade"):
        assert contrast(colours["ink"], colours[box]) >= 4.5, box
        for name in ("pass", "fail", "unsure"):
            assert contrast(colours[name], colours[box]) >= 4.5, (name, box)
    for line in ("blue", "vermilion", "green"):
        assert contrast(colours[line], page) >= 3.0, line
