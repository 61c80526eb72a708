"""The server of the studio: its address, its gate, its files and pages."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
from collections.abc import AsyncIterator, Callable
from pathlib import Path

import uvicorn
from fastapi import FastAPI
from nicegui import ui
from starlette.responses import FileResponse, PlainTextResponse, Response

from gyrobench.bench import Bench, UsageError
from gyrobench.errors import GyrobenchError
from gyrobench.files import FolderInUseError, FolderLock
from gyrobench.report.language import ENGLISH
from gyrobench.studio.command_pages import add_command_pages, served
from gyrobench.studio.data_page import add_data_page
from gyrobench.studio.frame import Studio
from gyrobench.studio.gate import TOKEN, StudioGate, is_loopback, refuse_remote
from gyrobench.studio.jobs import StudioJobs
from gyrobench.studio.laboratory_page import add_laboratory_page
from gyrobench.studio.learn_page import add_learn_pages
from gyrobench.studio.part_page import add_part_page
from gyrobench.studio.run_page import add_run_pages
from gyrobench.studio.system_page import add_system_page, wiring_of
from gyrobench.studio.systems_page import add_systems_page
from gyrobench.studio.words import say
from gyrobench.workflow.gallery import gallery, picture_of

PORT = 8765
TRIED = 20  # ports, from the first
SERVED = ("report.html", "report.pdf", "result.json", "run.json", "comparison.html", "comparison.pdf")
LOOK = 0.5  # s between two looks for jobs to start
AWAY = 60.0  # s without an answer of a browser, which may have much to do, after which its page is loaded anew
MESSAGE = 1 << 22  # bytes of a message of a page


def listen(host: str, port: int | None) -> socket.socket:
    """Return a socket that listens; without a port the first free one from PORT.  Raises UsageError."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    last: OSError | None = None
    for candidate in range(PORT, PORT + TRIED) if port is None else (port,):
        listener = socket.socket(family, socket.SOCK_STREAM)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind((host.strip("[]"), candidate))
            listener.listen(128)
            return listener
        except OSError as error:
            listener.close()
            last = error
    raise UsageError(f"--port {port or PORT}: {last.strerror if last else 'no port is free'}; name another one")


def host_names(host: str, port: int, remote: str | None) -> list[str]:
    """Return what a browser may write as Host: this machine's names with the port, and the name given for others."""
    names = [f"{h}:{port}" for h in ("127.0.0.1", "localhost", "[::1]")]
    if not is_loopback(host):
        names.append(f"{host}:{port}")
    return [*names, *([remote, f"{remote}:{port}"] if remote else [])]


def build(studio: Studio) -> FastAPI:
    """Return the application with all pages; called once in a process, as the front end keeps one list of pages."""

    @contextlib.asynccontextmanager
    async def jobs_advance(_: FastAPI) -> AsyncIterator[None]:
        async def advance() -> None:
            while True:
                with contextlib.suppress(OSError, GyrobenchError):
                    studio.jobs.advance()
                await asyncio.sleep(LOOK)

        task = asyncio.create_task(advance())
        warm = asyncio.create_task(asyncio.to_thread(gallery, studio.bench))
        yield
        task.cancel()
        warm.cancel()

    app = FastAPI(docs_url=None, redoc_url=None, openapi_url=None, lifespan=jobs_advance)

    @app.get("/files/{place:path}")
    def files(place: str) -> Response:
        """A file of a run, by name: nothing else of the bench is served."""
        try:
            file = studio.run_folder(place)
        except UsageError as error:
            return PlainTextResponse(str(error), 404)
        named = file.name in SERVED or served(studio.bench.out, file)
        if not named or not file.is_file() or file.is_relative_to(studio.jobs.folder.parent.resolve()):
            return PlainTextResponse("not a file of a run", 404)
        return FileResponse(file, headers={"cache-control": "no-store"})

    @app.get("/picture/{name}")
    def picture(name: str) -> Response:
        """The picture of a system: a figure of its report, else its wiring."""
        if name not in studio.bench.systems():
            return PlainTextResponse("no such system", 404)
        file = picture_of(studio.bench, name)
        if file is not None:
            return FileResponse(file, media_type="image/svg+xml", headers={"cache-control": "max-age=3600"})
        return Response(wiring_of(name), media_type="image/svg+xml")

    @app.get("/wiring/{name}")
    def wiring(name: str) -> Response:
        """The wiring of a system, drawn from what it declares."""
        if name not in studio.bench.systems():
            return PlainTextResponse("no such system", 404)
        return Response(wiring_of(name), media_type="image/svg+xml")

    add_systems_page(studio)
    add_system_page(studio)
    add_run_pages(studio)
    add_data_page(studio)
    add_command_pages(studio)
    add_laboratory_page(studio)
    add_part_page(studio)
    add_learn_pages(studio, app)
    ui.run_with(app, title=studio.title, dark=None, show_welcome_message=False, tailwind=False, reconnect_timeout=AWAY)
    return app


def serve(
    host: str, port: int | None, read_only: bool, remote: str | None, opened: Callable[[str], object] = print,
    language: str = ENGLISH,
) -> None:  # fmt: skip
    """Serve the studio until it is interrupted.

    opened: called with the first address, once the studio answers there.  language: of the pages at first.
    Raises UsageError for an address that others reach, unless ``remote`` says under which name, and where another
    studio has this bench open.
    """
    refuse_remote(host, remote)
    say.use(language)
    bench = Bench.find()
    studio = Studio(bench, StudioJobs(bench, read_only=read_only), read_only)
    with contextlib.ExitStack() as stack:
        if not read_only:
            stack.enter_context(_only_one(studio.jobs.folder.parent))
        listener = listen(host, port)
        stack.callback(listener.close)
        number = listener.getsockname()[1]
        gate = StudioGate(build(studio), host_names(host, number, remote), number, read_only=read_only)
        config = uvicorn.Config(
            gate, log_level="error", access_log=False, ws_max_size=MESSAGE, server_header=False, date_header=False,
            timeout_graceful_shutdown=2, lifespan="on", proxy_headers=False,
            ws_per_message_deflate=remote is not None,  # within a machine it costs more than it saves
        )  # fmt: skip
        shown = host if is_loopback(host) and host != "localhost" else "127.0.0.1"
        opened(f"http://{f'[{shown}]' if ':' in shown else shown}:{number}/?{TOKEN}={gate.token}")
        server = uvicorn.Server(config)
        # what strangers ask for is no line of the terminal, nor what is cut off when the studio ends
        logging.getLogger("nicegui").setLevel(logging.ERROR)
        logging.getLogger("engineio.server").setLevel(logging.CRITICAL)
        for name in ("uvicorn.error", "nicegui"):
            logging.getLogger(name).addFilter(lambda _: not server.should_exit)
        server.run(sockets=[listener])


def _only_one(folder: Path) -> FolderLock:
    """Return the lock of the studio of a bench.  Raises UsageError where another one has it."""
    try:
        return FolderLock(folder)
    except FolderInUseError:
        raise UsageError(f"{folder}: a studio has this bench open; close it, or look on: --read-only") from None
