"""``explore``: serve the page on this machine alone, and open it in the browser.

Who may open it: who has the token of this start, from this address, and from no other site.
"""

from __future__ import annotations

import gc
import hmac
import os
import secrets
import socket
import sys
import tempfile
import webbrowser
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager, nullcontext
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qsl

from bokeh.server.auth_provider import AuthProvider
from tornado.web import HTTPError
from tornado.websocket import WebSocketHandler

from nonsmooth.errors import not_installed

_LEADING = '<!DOCTYPE html><meta http-equiv="refresh" content="0; url={0}"><a href="{0}">nonsmooth explorer</a>'


class Access(AuthProvider):
    """A token per start, first in the address that is printed, then in a cookie that no other site is sent.

    The address that a browser is given holds another token, for one request: see :meth:`page_for_browser`.

    A request without it, to another host name (a page elsewhere whose name was made to point here), or sent by a page
    of another origin is answered with 403.
    """

    def __init__(self) -> None:
        self.token = secrets.token_urlsafe(24)
        self.hosts: set[str] = set()
        self._once: set[str] = set()  # tokens that have not been used yet
        self._cookie = f"nonsmooth_{secrets.token_hex(4)}"  # cookies are one for all ports
        super().__init__()

    def listen_at(self, port: int) -> None:
        """The port is known."""
        self.hosts = {f"127.0.0.1:{port}", f"localhost:{port}"}

    @property
    def get_user_async(self) -> Callable[[Any], Awaitable[str]]:
        """Return the check that the server makes before each answer, and before a socket is opened."""
        return self._checked

    @property
    def get_login_url(self) -> Callable[[Any], str]:
        """Return a function that is never reached: who is not let in is refused."""
        return lambda handler: "/"

    async def _checked(self, handler: Any) -> str:
        request = handler.request
        if request.host not in self.hosts:
            raise HTTPError(403, log_message=f"host {request.host!r}", reason="Not the address of this explorer")
        origin = request.headers.get("Origin")
        if origin is not None and origin.partition("://")[2] not in self.hosts:
            raise HTTPError(403, log_message=f"origin {origin!r}", reason="Requests from other sites are refused")
        given = handler.get_query_argument("token", None)
        if given is not None and (self._is_token(given) or self._is_first_use(given)):
            if not isinstance(handler, WebSocketHandler):
                handler.set_cookie(self._cookie, self.token, httponly=True, samesite="Strict", path="/")
            return "you"
        if self._is_token(handler.get_cookie(self._cookie, "")):
            return "you"
        raise HTTPError(403, log_message="no token", reason="Open the address that nonsmooth explore printed")

    @contextmanager
    def page_for_browser(self, address: str) -> Iterator[str]:
        """The address of a file that only this user can read and that leads to the page, while the block lasts.

        Command lines are for every user of the machine to see, and a browser is told in one what it is to open."""
        token = secrets.token_urlsafe(24)
        self._once.add(token)
        handle, name = tempfile.mkstemp(prefix="nonsmooth-", suffix=".html")  # of mode 600
        try:
            with os.fdopen(handle, "w", encoding="utf-8") as file:
                file.write(_LEADING.format(f"{address}/?token={token}"))
            yield Path(name).as_uri()
        finally:
            Path(name).unlink(missing_ok=True)

    def _is_first_use(self, text: str) -> bool:
        found = next((one for one in self._once if hmac.compare_digest(one.encode(), text.encode())), None)
        self._once.discard(found or "")
        return found is not None

    def _is_token(self, text: str | None) -> bool:
        return hmac.compare_digest((text or "").encode(), self.token.encode())


if TYPE_CHECKING:
    from nonsmooth.explorer.catalogue import Catalogue
    from nonsmooth.explorer.session import Page
    from nonsmooth.system.system import System

PORT = 5180


def explore(
    system: System | None = None,
    *,
    query: str = "",
    port: int | None = None,
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
    from nonsmooth.explorer.catalogue import Catalogue
    from nonsmooth.explorer.serve import Access
    from nonsmooth.explorer.worker import end_spare, prepare

    catalogue = Catalogue.of(system)
    catalogue.state_of(parse_qsl(query))  # a query that does not fit is refused before anything is served
    access, number = Access(), _free(port)
    application = Application(FunctionHandler(partial(_open, catalogue, query, [])))
    # No pings: on one machine nothing closes a silent socket, and one that fails takes the session from a connection
    # whose last messages Bokeh has still to read.
    server: Any = Server(
        application,
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
            server.io_loop.start()
        finally:
            server.stop()
            end_spare()


def _load() -> None:
    """Load what pages need while the browser starts. None of it is looked through again as a page is closed."""
    import_module("nonsmooth.explorer.session")
    gc.freeze()


def _open(catalogue: Catalogue, query: str, tabs: list[Page], document: Any) -> None:
    from nonsmooth.explorer.session import Page

    Page(document, catalogue.copy(), query, tabs)


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
