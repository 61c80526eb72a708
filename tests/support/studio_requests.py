"""Requests to a studio over a bare socket: good ones with their time, and hostile ones of every kind."""

from __future__ import annotations

import json
import random
import re
import socket
import string
import threading
import time
import uuid
from dataclasses import dataclass
from urllib.parse import urlencode

WALL = 300.0  # s, for one answer
NAMES = ("fixed_position", "tumble_single_axis", "floated_gyro", "run1")
PAGES = (
    "/", "/system/", "/part/", "/run/", "/runs", "/files/", "/picture/", "/wiring/", "/job/", "/pages/", "/data?file=",
    "/compare?run=", "/learn/", "/lesson/en/", "/_nicegui/", "/_nicegui_ws/socket.io/?EIO=4&transport=polling&x=",
)  # fmt: skip
UGLY = (
    "../", "..%2f", "%2e%2e/", "%00", "\\..\\", "//", "%252e%252e%252f", "<script>alert(1)</script>", "'\"><img src=x>",
    "{{7*7}}", "${jndi:ldap://x}", "%0d%0aset-cookie:x=y", "é€", "\u202e", "CON", "~root", "etc/passwd",
    "file:///etc/passwd", ".git/config", "reports/out", "studio/jobs", "a" * 3000,
)  # fmt: skip
METHODS = ("GET", "GET", "GET", "POST", "PUT", "DELETE", "TRACE", "CONNECT", "PATCH", "G\x00T", "HEAD")


@dataclass(frozen=True)
class Door:
    """Where a studio listens and what opens it, of its first address."""

    port: int
    token: str

    @classmethod
    def of(cls, address: str) -> Door:
        found = re.search(r":(\d+)/\?token=([\w-]+)", address)
        assert found, address
        return cls(int(found[1]), found[2])

    @property
    def cookie(self) -> str:
        return f"gyrobench_studio_{self.port}={self.token}"

    def send(self, raw: bytes, whole: bool = True) -> bytes:
        """Return the answer to bytes, b"" where the studio only closes.  whole: False for what it waits for more of.

        Raises TimeoutError where a whole request gets no answer.
        """
        blocks: list[bytes] = []
        with socket.create_connection(("127.0.0.1", self.port), timeout=WALL if whole else 0.3) as link:
            try:
                link.sendall(raw)
                while block := link.recv(1 << 16):
                    blocks.append(block)
            except ConnectionError:
                pass  # it was closed before all was sent
            except TimeoutError:
                if whole:
                    raise
        return b"".join(blocks)

    def get(self, path: str) -> tuple[int, float, bytes]:
        """Return status, s and answer of a page."""
        began = time.perf_counter()
        lines = (
            f"GET {path} HTTP/1.1\r\nhost: 127.0.0.1:{self.port}\r\ncookie: {self.cookie}\r\nconnection: close\r\n\r\n"
        )
        answer = self.send(lines.encode())
        return int(answer.split(b" ", 2)[1]), time.perf_counter() - began, answer

    def hostile(self, rng: random.Random) -> tuple[bytes, bool]:
        """Return a request with something wrong in path, method, host, origin, cookie, length or body; is it whole?"""
        path = rng.choice(PAGES) + "".join(rng.choice((*UGLY, *NAMES, "/")) for _ in range(rng.randint(1, 4)))
        method = rng.choice(METHODS)
        own = f"127.0.0.1:{self.port}"
        host = rng.choice((own, own, own, "evil.example", f"{own}.evil.example", "", "[::1]", "\x01"))
        headers = [f"host: {host}", "connection: close"]
        if rng.random() < 0.7:
            headers.append(f"cookie: {self.cookie}")
        if rng.random() < 0.4:
            headers.append(f"origin: {rng.choice(('http://evil.example', 'null', f'http://{own}', 'javascript:1'))}")
        body = "".join(rng.choice(string.printable) for _ in range(rng.choice((0, 0, 10, 2000))))
        if rng.random() < 0.4:
            headers.append(f"content-length: {rng.choice((len(body.encode()), -1, 10**12, 1 << 25, 'x'))}")
        if rng.random() < 0.1:
            headers.append(f"x-junk: {'j' * rng.choice((10, 70_000))}")
        head = f"{method} {path} HTTP/1.1\r\n" + "\r\n".join(headers) + "\r\n\r\n"
        raw = (head + body).encode("utf-8", "surrogatepass")
        cut = rng.random() < 0.03
        return (raw[: rng.randint(1, len(raw) - 1)] if cut else raw), not cut


class SocketTab:
    """A tab without a browser: a page is fetched, its socket opened, every message taken and confirmed; none is drawn.

    messages: that have come.
    """

    CONFIRM = 3.0  # s between two confirmations, as the front end does it

    def __init__(self, door: Door, path: str) -> None:
        from websockets.sync.client import connect

        self.path, self.messages, self.following = path, 0, 0
        page = door.get(path)[2].decode()
        found = re.search(r"client_id\W+([0-9a-f-]{36})", page)
        assert found, page[:200]
        self.client = found[1]
        query = {
            "EIO": 4, "transport": "websocket", "client_id": self.client, "implicit_handshake": "true",
            "tab_id": uuid.uuid4(), "document_id": uuid.uuid4(), "next_message_id": 0,
        }  # fmt: skip
        host = f"127.0.0.1:{door.port}"
        self.link = connect(
            f"ws://{host}/_nicegui_ws/socket.io/?{urlencode(query)}", max_size=None,
            additional_headers={"cookie": door.cookie, "origin": f"http://{host}"},
        )  # fmt: skip
        self.link.send("40")
        self.thread = threading.Thread(target=self._listen, daemon=True)
        self.thread.start()

    def _listen(self) -> None:
        from websockets.exceptions import ConnectionClosed

        confirmed, last = 0, time.monotonic()
        try:
            while True:
                text = str(self.link.recv())
                if text == "2":  # is somebody there?
                    self.link.send("3")
                elif text.startswith("42"):
                    self.messages += 1
                    number = re.findall(r'"_id":(\d+)', text)
                    self.following = max(self.following, int(number[-1]) + 1 if number else 0)
                if self.following > confirmed and time.monotonic() > last + self.CONFIRM:
                    confirmed, last = self.following, time.monotonic()
                    word = ["ack", {"client_id": self.client, "next_message_id": confirmed}]
                    self.link.send(f"42{json.dumps(word)}")
        except ConnectionClosed:
            return

    def close(self) -> None:
        """Close the tab."""
        self.link.close()
        self.thread.join(5.0)


def wrong(answer: bytes) -> str:
    """Return what an answer to a hostile request gives away, "" for nothing."""
    if (b"root:" in answer and b":/bin/" in answer) or b"Traceback (most recent call last)" in answer:
        return "content of the machine"
    head, _, body = answer.partition(b"\r\n\r\n")
    if head.split(b" ", 2)[1:2] and head.split(b" ", 2)[1].startswith(b"5"):
        return head.split(b"\r\n")[0].decode("latin-1")
    if b"\r\nset-cookie: x=y" in head.lower():
        return "a header of the request"
    if b"text/html" in head and b"<script>alert(1)</script>" in body:
        return "a script of the request"
    return ""
