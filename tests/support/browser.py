"""A page in headless Chromium, driven by its DevTools protocol: size, keys, console, times, pictures."""

from __future__ import annotations

import asyncio
import base64
import json
import re
import shutil
import subprocess
import time
from pathlib import Path
from typing import Any, Self

import pytest

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))), None)
needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="no chromium on PATH: pages are not looked at")
KEYS = {"Tab": 9, "Enter": 13, " ": 32, "End": 35, "ArrowDown": 40}
#: pairs of texts of one figure that lie on each other
OVERLAPS = """Array.from(document.querySelectorAll('.picture svg')).flatMap(svg => {
  const boxes = Array.from(svg.querySelectorAll('g[id*="-text_"]'), g => [g.id, g.getBoundingClientRect()])
    .filter(b => b[1].width > 0);
  return boxes.flatMap((a, i) => boxes.slice(i + 1)
    .filter(b => Math.min(a[1].right, b[1].right) - Math.max(a[1].left, b[1].left) > 1.5 &&
                 Math.min(a[1].bottom, b[1].bottom) - Math.max(a[1].top, b[1].top) > 2.5)
    .map(b => a[0] + ' over ' + b[0]));
})"""
LIMIT = 300.0  # s for one answer of the browser: a machine that has others to serve too is slow, not wrong


class Browser:
    """Context manager: one browser, one page; ``console`` gathers what the page complains about."""

    def __init__(self, profile: Path) -> None:
        self.profile = profile
        self.console: list[str] = []
        self.events: list[str] = []
        self._number = 0
        self._session = ""

    def __enter__(self) -> Self:
        from tornado.ioloop import IOLoop
        from tornado.websocket import websocket_connect

        assert CHROMIUM is not None
        flags = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--no-first-run",
                 "--remote-debugging-port=0", f"--user-data-dir={self.profile}", "about:blank"]  # fmt: skip
        self._log = (self.profile.parent / "chromium.log").open("w+")
        self._process = subprocess.Popen([CHROMIUM, *flags], stderr=self._log, stdout=subprocess.DEVNULL)
        self._loop = IOLoop(make_current=False)
        address = self._address()
        self._socket = self._loop.run_sync(lambda: websocket_connect(address, max_message_size=1 << 28), timeout=LIMIT)
        target = self("Target.createTarget", url="about:blank")["targetId"]
        self._session = self("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self(f"{domain}.enable")
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()
        self._process.terminate()
        self._process.wait(LIMIT)
        self._loop.close()
        asyncio.set_event_loop(None)
        self._log.close()

    def _address(self) -> str:
        deadline = time.monotonic() + LIMIT
        while time.monotonic() < deadline:
            found = re.search(r"DevTools listening on (ws://\S+)", Path(self._log.name).read_text())
            if found:
                return found[1]
            time.sleep(0.05)
        raise TimeoutError("the browser does not answer")

    def __call__(self, method: str, **params: Any) -> dict[str, Any]:
        """Send a command and return its result."""
        self._number += 1
        message = {"id": self._number, "method": method, "params": params}
        if self._session:
            message["sessionId"] = self._session
        asyncio.set_event_loop(self._loop.asyncio_loop)  # type: ignore[attr-defined]  # another test may have taken it away
        self._socket.write_message(json.dumps(message))
        while True:
            answer = self._read()
            if answer.get("id") == self._number:
                assert "error" not in answer, answer["error"]
                return dict(answer["result"])

    def _read(self) -> dict[str, Any]:
        answer = json.loads(self._loop.run_sync(self._socket.read_message, timeout=LIMIT))
        method, params = answer.get("method"), answer.get("params", {})
        if method == "Runtime.exceptionThrown":
            self.console.append(str(params["exceptionDetails"]))
        elif method == "Runtime.consoleAPICalled" and params["type"] in ("error", "warning", "assert"):
            self.console.append(str(params["args"]))
        elif method == "Log.entryAdded" and params["entry"]["level"] in ("error", "warning"):
            self.console.append(params["entry"]["text"])
        elif method == "Network.requestWillBeSent" and not params["request"]["url"].startswith(("file:", "data:")):
            self.console.append(f"network: {params['request']['url']}")
        if method:
            self.events.append(method)
        return dict(answer)

    def open(self, page: Path, width: int, height: int = 900) -> float:
        """Open a page in a window of this width; return the seconds until it is loaded and painted."""
        self("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=width < 600)
        self.events.clear()
        began = time.monotonic()
        self("Page.navigate", url=page.absolute().as_uri())
        while "Page.loadEventFired" not in self.events:
            self._read()
        self.run("new Promise(r => requestAnimationFrame(() => setTimeout(() => r(1), 0)))")
        return time.monotonic() - began

    def run(self, script: str) -> Any:
        """Return the value of an expression in the page."""
        answer = self("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def key(self, key: str, **modifiers: Any) -> None:
        """Press a key."""
        code = KEYS.get(key, ord(key[0].upper()))
        text = {"Enter": "\r", " ": " "}.get(key, key if len(key) == 1 else "")
        down = {"text": text} if text else {}
        self("Input.dispatchKeyEvent", type="keyDown", key=key, windowsVirtualKeyCode=code, **down, **modifiers)
        self("Input.dispatchKeyEvent", type="keyUp", key=key, windowsVirtualKeyCode=code, **modifiers)

    def type(self, text: str) -> None:
        """Put text where the focus is."""
        self("Input.insertText", text=text)

    def picture(self, file: Path, full: bool = True) -> None:
        """Save the page as PNG."""
        content = self("Page.captureScreenshot", captureBeyondViewport=full, **self._clip() if full else {})
        file.write_bytes(base64.b64decode(content["data"]))

    def _clip(self) -> dict[str, Any]:
        size = self("Page.getLayoutMetrics")["cssContentSize"]
        return {"clip": {"x": 0, "y": 0, "width": size["width"], "height": min(size["height"], 14000), "scale": 1}}
