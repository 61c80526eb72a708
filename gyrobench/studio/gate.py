"""The gate of the studio: every request and every socket passes here first.

It lets in who has the token of this start, from a page of this address, with requests of a limited size.  The token is
in the first address only and becomes a cookie; other web pages cannot send it (SameSite) and are told apart by their
Origin; a foreign name that was made to point here (DNS rebinding) by its Host.
"""

from __future__ import annotations

import hmac
import ipaddress
import secrets
from collections.abc import Awaitable, Callable, Iterable, MutableMapping
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs, urlencode

from gyrobench.bench import UsageError
from gyrobench.errors import GyrobenchError

Scope = MutableMapping[str, Any]
Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

SMALL = 1 << 20  # bytes of a request
UPLOAD = 1 << 28  # bytes of a request that brings a file
TOKEN = "token"
#: nothing is loaded from elsewhere; the front end compiles its templates in the page
POLICY = (
    "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval' blob:; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; font-src 'self' data:; worker-src 'self' blob:; connect-src 'self' ws: wss:; "
    "object-src 'none'; base-uri 'self'; form-action 'self'; frame-ancestors 'self'"
)
HEADERS = (
    (b"content-security-policy", POLICY.encode()),
    (b"x-content-type-options", b"nosniff"),
    (b"x-frame-options", b"SAMEORIGIN"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-resource-policy", b"same-origin"),
)


class _TooLargeError(GyrobenchError):
    """A body that is longer than it may be."""


def is_loopback(host: str) -> bool:
    """Return whether an address is of this machine alone."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


def refuse_remote(host: str, remote: str | None) -> None:
    """Raise UsageError for an address that others reach, unless it is asked for."""
    if not is_loopback(host) and not remote:
        raise UsageError(
            f"--host {host}: others could reach the studio, and it has no users and no encryption; serve it through a "
            "proxy with authentication and TLS, and say under which name: --allow-remote bench.example.org"
        )


class StudioGate:
    """ASGI middleware; ``token`` opens it.

    names: of the host, as a browser writes them, with the port.  read_only: nothing is uploaded.
    """

    def __init__(self, app: App, names: Iterable[str], port: int, token: str = "", read_only: bool = False) -> None:
        self.app, self.read_only = app, read_only
        self.names = frozenset(n.lower() for n in names)
        self.token = token or secrets.token_urlsafe(32)
        self.cookie = f"gyrobench_studio_{port}"

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        kind = scope["type"]
        if kind == "lifespan":
            await self.app(scope, receive, send)
        elif kind == "http":
            await self._http(scope, receive, send)
        elif kind == "websocket" and self._refusal(scope) is None and _header(scope, b"origin"):
            await self.app(scope, receive, send)
        elif kind == "websocket":
            await receive()  # the request to open it
            await send({"type": "websocket.close", "code": 4403})

    async def _http(self, scope: Scope, receive: Receive, send: Send) -> None:
        query = parse_qs(scope.get("query_string", b"").decode("latin-1"), keep_blank_values=True)
        offered = query.pop(TOKEN, None)
        if offered is not None and self._named(scope) and scope["method"] == "GET":
            if self._same(offered[0]):
                await _answer(send, 303, "", self._entrance(scope["path"], query))
            else:
                await _answer(send, 403, "This address is of an earlier start of the studio. Open the one it printed.")
            return
        if (refusal := self._refusal(scope)) is not None:
            await _answer(send, *refusal)
            return
        upload = scope["method"] == "POST" and "/upload/" in scope["path"]
        if upload and self.read_only:
            await _answer(send, 403, "The studio is read-only.")
            return
        limited = _limited(receive, UPLOAD if upload else SMALL)
        begun = gone = False

        async def heard() -> Message:
            nonlocal gone
            message = await limited()
            gone = gone or message["type"] == "http.disconnect"
            return message

        async def guarded(message: Message) -> None:
            nonlocal begun
            if message["type"] == "http.response.start":
                begun = True
                own = {name for name, _ in HEADERS}
                kept = [h for h in message.get("headers", []) if h[0].lower() not in own]
                message = {**message, "headers": [*kept, *HEADERS]}
            await send(message)

        try:
            if (length := _length(scope)) is None or length > (UPLOAD if upload else SMALL):
                raise _TooLargeError
            await self.app(scope, heard, guarded)
        except RuntimeError:  # a page that was left before its answer: the framework complains of none
            if not gone:
                raise
        except _TooLargeError:
            if not begun:
                await _answer(send, 413, "The request is too large.")

    def _entrance(self, path: str, query: dict[str, list[str]]) -> list[tuple[bytes, bytes]]:
        """Return the headers that set the cookie and lead to the same page without the token."""
        rest = f"?{urlencode(query, doseq=True)}" if query else ""
        target = "/" + path.lstrip("/\\")  # "//host" would lead elsewhere
        safe = "".join(c for c in f"{target}{rest}" if c.isascii() and c.isprintable() and c != "\\")
        cookie = f"{self.cookie}={self.token}; Path=/; HttpOnly; SameSite=Strict"
        return [(b"location", safe.encode()), (b"set-cookie", cookie.encode())]

    def _refusal(self, scope: Scope) -> tuple[int, str] | None:
        """Return status and reason for a request that is not let in; None for one that is."""
        if not self._named(scope):
            return 421, "The studio is not reached under this name."
        origin = _header(scope, b"origin")
        if origin and origin.lower().partition("://")[2] not in self.names:
            return 403, "The request comes from another page."
        if scope["type"] == "http" and scope["method"] not in ("GET", "HEAD", "POST"):
            return 405, "Not a request that the studio answers."
        if not self._same(self._cookie(scope)):
            return 403, "Open the address that gyrobench studio has printed: it holds the token of this start."
        return None

    def _named(self, scope: Scope) -> bool:
        hosts = [v for k, v in scope["headers"] if k.lower() == b"host"]
        return len(hosts) == 1 and hosts[0].decode("latin-1").lower() in self.names

    def _cookie(self, scope: Scope) -> str:
        jar: SimpleCookie = SimpleCookie()
        try:
            jar.load(_header(scope, b"cookie"))
        except CookieError:
            return ""
        return jar[self.cookie].value if self.cookie in jar else ""

    def _same(self, text: str) -> bool:
        return hmac.compare_digest(text.encode("utf-8", "replace"), self.token.encode())


def _header(scope: Scope, name: bytes) -> str:
    return next((v.decode("latin-1") for k, v in scope["headers"] if k.lower() == name), "")


def _length(scope: Scope) -> int | None:
    """Return the stated length of the body, 0 where none is; None for a statement that is no number."""
    stated = _header(scope, b"content-length") or "0"
    return int(stated) if stated.isascii() and stated.isdigit() and len(stated) < 20 else None


def _limited(receive: Receive, most: int) -> Receive:
    """Return a receiver that raises _TooLargeError once the body is longer, whatever was stated."""
    seen = 0

    async def limited() -> Message:
        nonlocal seen
        message = await receive()
        seen += len(message.get("body", b""))
        if seen > most:
            raise _TooLargeError
        return message

    return limited


async def _answer(send: Send, status: int, text: str, headers: Iterable[tuple[bytes, bytes]] = ()) -> None:
    """Send a short answer in plain text."""
    body = text.encode()
    fixed = [(b"content-type", b"text/plain; charset=utf-8"), (b"content-length", str(len(body)).encode()), *HEADERS]
    await send({"type": "http.response.start", "status": status, "headers": [*fixed, *headers]})
    await send({"type": "http.response.body", "body": body})
