"""The gate of the studio against requests that do not come from its own pages."""

from __future__ import annotations

import asyncio
import random
from pathlib import Path
from typing import Any

import pytest

from gyrobench.bench import UsageError
from gyrobench.studio import gate as gates
from gyrobench.studio.gate import StudioGate, is_loopback, refuse_remote

PORT = 8765
HOST = f"127.0.0.1:{PORT}"


class App:
    """Counts what comes through; answers with the length of the body."""

    def __init__(self) -> None:
        self.calls = 0

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        self.calls += 1
        if scope["type"] == "websocket":
            await send({"type": "websocket.accept"})
            return
        length = 0
        while True:
            message = await receive()
            length += len(message.get("body", b""))
            if not message.get("more_body"):
                break
        await send({"type": "http.response.start", "status": 200, "headers": [(b"x-frame-options", b"ALLOWALL")]})
        await send({"type": "http.response.body", "body": str(length).encode()})


def ask(
    gate: StudioGate, path: str = "/", method: str = "GET", headers: dict[str, str] | None = None, query: str = "",
    body: list[bytes] | None = None, kind: str = "http",
) -> list[dict[str, Any]]:  # fmt: skip
    """Return what the gate sends; headers replace those of a good request, "" leaves one out."""
    given = {"host": HOST, "cookie": f"{gate.cookie}={gate.token}", **(headers or {})}
    scope = {
        "type": kind, "method": method, "path": path, "query_string": query.encode("latin-1", "replace"),
        "headers": [(k.encode(), v.encode("latin-1", "replace")) for k, v in given.items() if v],
    }  # fmt: skip
    blocks = list(body or [b""])
    sent: list[dict[str, Any]] = []

    async def receive() -> dict[str, Any]:
        return {"type": "http.request", "body": blocks.pop(0), "more_body": bool(blocks)}

    async def send(message: Any) -> None:
        sent.append(dict(message))

    asyncio.run(gate(scope, receive, send))
    return sent


@pytest.fixture
def app() -> App:
    return App()


@pytest.fixture
def gate(app: App) -> StudioGate:
    return StudioGate(app, [HOST, f"localhost:{PORT}"], PORT)


def status(sent: list[dict[str, Any]]) -> int:
    return int(sent[0]["status"])


def test_the_token_becomes_a_cookie_once(gate: StudioGate, app: App) -> None:
    sent = ask(gate, "/runs", headers={"cookie": ""}, query=f"token={gate.token}&a=b%20c")
    headers = dict(sent[0]["headers"])
    assert status(sent) == 303 and headers[b"location"] == b"/runs?a=b+c" and app.calls == 0
    cookie = headers[b"set-cookie"].decode()
    assert cookie.startswith(f"{gate.cookie}={gate.token};") and "HttpOnly" in cookie and "SameSite=Strict" in cookie
    assert status(ask(gate)) == 200 and app.calls == 1
    assert len(gate.token) > 30 and StudioGate(app, [HOST], PORT).token != gate.token


def test_an_entrance_leads_nowhere_else(gate: StudioGate) -> None:
    for path in ("//evil.example/x", "/\\evil.example", "\\\\evil.example"):
        target = dict(ask(gate, path, query=f"token={gate.token}")[0]["headers"])[b"location"]
        assert target.startswith(b"/") and not target.startswith((b"//", b"/\\")), target
    split = dict(ask(gate, "/a\r\nset-cookie: x=y", query=f"token={gate.token}")[0]["headers"])[b"location"]
    assert b"\r" not in split and b"\n" not in split


@pytest.mark.parametrize(
    ("headers", "expected"),
    [
        ({"cookie": ""}, 403),
        ({"cookie": "gyrobench_studio_8765=wrong"}, 403),
        ({"cookie": "a=b; ;;=;\x01"}, 403),
        ({"host": ""}, 421),
        ({"host": "evil.example"}, 421),
        ({"host": "evil.example:8765"}, 421),
        ({"host": "127.0.0.1"}, 421),
        ({"host": "127.0.0.1:1"}, 421),
        ({"host": f"{HOST}.evil.example"}, 421),
        ({"origin": "http://evil.example"}, 403),
        ({"origin": "null"}, 403),
        ({"origin": "http://127.0.0.1:9999"}, 403),
        ({"origin": f"http://{HOST}@evil.example"}, 403),
        ({"content-length": str(gates.SMALL + 1)}, 413),
        ({"content-length": "-1"}, 413),
        ({"content-length": "1e9"}, 413),
    ],
)
def test_refused(gate: StudioGate, app: App, headers: dict[str, str], expected: int) -> None:
    assert status(ask(gate, headers=headers)) == expected
    assert app.calls == 0


def test_a_wrong_token_is_refused(gate: StudioGate, app: App) -> None:
    for token in ("", "x", gate.token[:-1], gate.token + "x", "ü"):
        assert status(ask(gate, headers={"cookie": ""}, query=f"token={token}")) == 403
    good = {"cookie": "", "host": "evil.example"}
    assert status(ask(gate, headers=good, query=f"token={gate.token}")) == 421
    assert app.calls == 0


@pytest.mark.parametrize("method", ["PUT", "DELETE", "OPTIONS", "TRACE", "CONNECT", "PATCH", "X"])
def test_other_methods_are_refused(gate: StudioGate, app: App, method: str) -> None:
    assert status(ask(gate, method=method)) == 405 and app.calls == 0


def test_a_body_is_counted_whatever_it_says(gate: StudioGate) -> None:
    block = b"x" * (1 << 18)
    assert ask(gate, method="POST", body=[block] * 4)[1]["body"] == str(4 << 18).encode()
    assert status(ask(gate, method="POST", body=[block] * 5, headers={"content-length": "3"})) == 413


def test_uploads_may_be_larger_but_not_in_a_show(app: App) -> None:
    block, path = b"x" * (1 << 20), "/_nicegui/client/abc/upload/3"
    assert status(ask(StudioGate(app, [HOST], PORT), path, "POST", body=[block] * 3)) == 200
    show = StudioGate(app, [HOST], PORT, read_only=True)
    assert status(ask(show, path, "POST", body=[b"x"])) == 403
    assert status(ask(show, "/_nicegui_ws/socket.io/", "POST", body=[b"x"])) == 200, "the pages still work"


def test_sockets_need_cookie_and_origin(gate: StudioGate, app: App) -> None:
    own = {"origin": f"http://{HOST}"}
    assert ask(gate, kind="websocket", headers=own)[0]["type"] == "websocket.accept"
    for headers in ({}, {"origin": "http://evil.example"}, {**own, "cookie": ""}, {**own, "host": "evil.example"}):
        assert ask(gate, kind="websocket", headers=headers)[0]["type"] == "websocket.close", headers
    assert app.calls == 1


def test_answers_carry_the_policy(gate: StudioGate) -> None:
    for sent in (ask(gate), ask(gate, headers={"cookie": ""})):
        headers = [(k, v) for k, v in sent[0]["headers"] if k == b"x-frame-options"]
        assert headers == [(b"x-frame-options", b"SAMEORIGIN")]
        policy = dict(sent[0]["headers"])[b"content-security-policy"].decode()
        assert "default-src 'self'" in policy and "http:" not in policy and "https:" not in policy


def test_nothing_random_gets_in_or_crashes_it(gate: StudioGate, app: App) -> None:
    """2,000 requests with something wrong in each; none reaches the pages, each is answered."""
    draw = random.Random(7)

    def text() -> str:
        return "".join(
            chr(draw.choice([0, 10, 13, 34, 37, 46, 47, 60, 92, 97, 200, 255])) for _ in range(draw.randint(1, 40))
        )

    wrong = [
        lambda: {"headers": {"cookie": text()}},
        lambda: {"headers": {"host": text()}},
        lambda: {"headers": {"origin": text()}},
        lambda: {"headers": {"content-length": f"9{draw.randint(10**7, 10**30)}"}},
        lambda: {"method": text()},
        lambda: {"query": f"token={text()}"},
    ]
    for _ in range(2000):
        given = draw.choice(wrong)()
        sent = ask(gate, path=f"/{text()}", **given)  # type: ignore[arg-type]
        assert status(sent) in (303, 403, 405, 413, 421), given
        assert status(sent) != 303
    assert app.calls == 0


def test_other_addresses_need_a_name() -> None:
    for host in ("127.0.0.1", "127.3.4.5", "localhost", "::1", "[::1]"):
        assert is_loopback(host)
        refuse_remote(host, None)
    for host in ("0.0.0.0", "::", "192.168.1.4", "bench.example.org", "", "127.0.0.1.evil.example"):
        assert not is_loopback(host)
        with pytest.raises(UsageError, match="proxy with authentication"):
            refuse_remote(host, None)
        refuse_remote(host, "bench.example.org")


def test_the_face_stays_small() -> None:
    """At most 4,000 lines of Python and 600 of JavaScript: nothing is computed in it."""
    files = [*Path(gates.__file__).parent.iterdir()]
    for suffix, most in ((".py", 4000), (".js", 600)):
        lines = sum(f.read_text(encoding="utf-8").count("\n") for f in files if f.suffix == suffix)
        assert 0 < lines <= most, f"{suffix}: {lines}"
