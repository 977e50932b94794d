"""Who may open the page: who has the token of this start, from this address, and from no other site."""

from __future__ import annotations

import hmac
import os
import secrets
import tempfile
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from bokeh.server.auth_provider import AuthProvider
from tornado.web import HTTPError
from tornado.websocket import WebSocketHandler

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
