"""``explore``: serve the page on this machine alone, and open it in the browser."""

from __future__ import annotations

import gc
import signal
import socket
import sys
import threading
import webbrowser
from collections.abc import Callable
from contextlib import nullcontext
from importlib import import_module
from typing import TYPE_CHECKING, Annotated, Any
from urllib.parse import parse_qsl

from nonsmooth.errors import not_installed
from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import at_least
from nonsmooth.system.system import System

if TYPE_CHECKING:
    from nonsmooth.explorer.session import Page

PORT = 5180


@checked
def explore(
    system: System | None = None,
    *,
    query: str = "",
    port: Annotated[int, at_least(0, 65535)] | None = None,
    browser: bool = True,
    told: Callable[[str], object] | None = None,
) -> None:
    """Open the explorer in the browser, and serve it until Ctrl-C.

    Parameters
    ----------
    system : System, optional
        What the page begins with; the paper's oscillator where not given. The models of ``nonsmooth.models`` can be
        chosen in the page.
    query : str, optional
        A view to begin with: the part of a page's address behind the question mark.
    port : int, optional
        Port on 127.0.0.1: 5180 where not given, or any free one where that is taken.
    browser : bool
        Open a browser; the address is printed in any case.
    told : function, optional
        Hears the address once the page can be opened.

    Raises
    ------
    ImportError
        The package bokeh is missing.
    ValueError
        A port that is taken, or a query that does not fit the system.
    """
    try:
        from bokeh.application import Application
        from bokeh.application.handlers.function import FunctionHandler
        from bokeh.server.server import Server
    except ImportError as error:
        raise ImportError(f"the explorer needs {not_installed('bokeh', 'explorer')}") from error
    import matplotlib as mpl

    mpl.use("Agg")  # figures are made for files, in threads
    from nonsmooth.explorer.access import Access
    from nonsmooth.explorer.catalogue import Catalogue
    from nonsmooth.explorer.worker import end_spare, prepare

    catalogue = Catalogue.of(system)
    catalogue.state_of(parse_qsl(query))  # a query that does not fit is refused before anything is served
    access, number = Access(), _free(port)
    tabs: list[Page] = []

    def opened(document: Any) -> None:
        from nonsmooth.explorer.session import Page

        Page(document, catalogue.copy(), query, tabs)

    # No pings: on one machine nothing closes a silent socket, and one that fails takes the session from a connection
    # whose last messages Bokeh has still to read.
    server: Any = Server(
        Application(FunctionHandler(opened)),
        port=number,
        address="127.0.0.1",
        auth_provider=access,
        index=None,
        allow_websocket_origin=[f"127.0.0.1:{number}", f"localhost:{number}"],
        websocket_max_message_size=256 * 1024 * 1024,
        keep_alive_milliseconds=0,
        unused_session_lifetime_milliseconds=5_000,
        check_unused_sessions_milliseconds=300,
        session_token_expiration=3600,
    )
    access.listen_at(number)
    prepare()
    server.start()
    origin = f"http://127.0.0.1:{number}"
    address = f"{origin}/?token={access.token}"
    print(f"nonsmooth explorer: {address}\nCtrl-C ends it", file=sys.stderr, flush=True)
    if told is not None:
        told(address)
    server.io_loop.add_callback(_load)
    with access.page_for_browser(origin) if browser else nullcontext() as page:
        if page is not None:
            server.io_loop.add_callback(webbrowser.open, page)
        try:
            run(server.io_loop)
        finally:
            server.stop()
            end_spare()


def run(loop: Any) -> None:
    """Run a loop of events until Ctrl-C, which it is told: an exception there and then is lost where something is
    being freed. A second Ctrl-C raises at once."""
    asked: list[int] = []

    def ask(number: int, _: object) -> None:
        asked.append(number)
        if len(asked) > 1:
            raise KeyboardInterrupt
        loop.asyncio_loop.call_soon_threadsafe(loop.stop)

    usual = signal.getsignal(signal.SIGINT)
    heard = usual is signal.default_int_handler and threading.current_thread() is threading.main_thread()
    if heard:
        signal.signal(signal.SIGINT, ask)
    try:
        loop.start()
    finally:
        if heard:
            signal.signal(signal.SIGINT, usual)
    if asked:
        raise KeyboardInterrupt


def _load() -> None:
    """Load what pages need while the browser starts. None of it is looked through again as a page is closed."""
    import_module("nonsmooth.explorer.session")
    gc.freeze()


def _free(port: int | None) -> int:
    """The port asked for; else the usual one, so that a view's address can be shared, or any that is free."""
    for number in (PORT, 0) if port is None else (port,):
        with socket.socket() as one:
            one.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                one.bind(("127.0.0.1", number))
            except OSError as error:
                if port is None and number:
                    continue
                raise ValueError(f"port {port} cannot be used ({error.strerror}); give another with --port") from error
            return int(one.getsockname()[1])
    raise AssertionError
