"""Who is let in: requests with the token of this start, from this address, and from no other site."""

from __future__ import annotations

import http.client
from typing import Any

import pytest


def ask(server: Any, path: str, **headers: str) -> tuple[int, dict[str, str]]:
    connection = http.client.HTTPConnection("127.0.0.1", int(server.origin.rpartition(":")[2]), timeout=60)
    try:
        connection.request("GET", path, headers=headers)
        answer = connection.getresponse()
        answer.read()
        return answer.status, dict(answer.getheaders())
    finally:
        connection.close()


def handshake(origin: str) -> dict[str, str]:
    return {
        "Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13", "Origin": origin,
        "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==", "Sec-WebSocket-Protocol": "bokeh, nothing",
    }  # fmt: skip


def test_the_token_lets_in_and_the_cookie_after_it(server: Any) -> None:
    status, headers = ask(server, f"/?token={server.token}")
    assert status == 200
    cookie = headers["Set-Cookie"]
    assert "HttpOnly" in cookie
    assert "SameSite=Strict" in cookie
    assert ask(server, "/", Cookie=cookie.partition(";")[0])[0] == 200


@pytest.mark.parametrize("path", ["/", "/?token=", "/?token=guessed", "/autoload.js", "/metadata"])
def test_without_the_token_nothing_is_shown(server: Any, path: str) -> None:
    assert ask(server, path)[0] == 403


def test_other_sites_are_refused_even_with_the_token(server: Any) -> None:
    address = f"/?token={server.token}"
    assert ask(server, address, Origin="https://example.org")[0] == 403
    assert ask(server, address, Host="example.org")[0] == 403
    assert ask(server, address, Origin=server.origin)[0] == 200


def test_the_socket_asks_for_the_same(server: Any) -> None:
    assert ask(server, "/ws", **handshake(server.origin))[0] == 403
    assert ask(server, f"/ws?token={server.token}", **handshake("https://example.org"))[0] == 403
