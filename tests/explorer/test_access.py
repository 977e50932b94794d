"""Who is let in: requests with the token of this start, from this address, and from no other site."""

from __future__ import annotations

import http.client
import os
import signal
import subprocess
import sys
import urllib.parse
from pathlib import Path
from typing import Any

import pytest
from tests.explorer.conftest import Server


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
        "Upgrade": "websocket",
        "Connection": "Upgrade",
        "Sec-WebSocket-Version": "13",
        "Origin": origin,
        "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
        "Sec-WebSocket-Protocol": "bokeh, nothing",
    }


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


@pytest.mark.skipif(os.name == "nt", reason="programs as scripts, and modes of files")
def test_the_browser_is_told_a_file_that_only_the_user_can_read(server: Any) -> None:
    """Every user may read command lines: none holds a token, and the one in the file serves once."""
    file = server.page_told()
    assert file.stat().st_mode & 0o777 == 0o600
    leads_to = file.read_text().partition("url=")[2].partition('"')[0]
    assert leads_to.startswith(f"{server.origin}/?token=")
    assert server.token not in file.read_text()
    path = leads_to.removeprefix(server.origin)
    assert [ask(server, path)[0] for _ in range(2)] == [200, 403]


@pytest.mark.skipif(os.name == "nt", reason="modes of files")
def test_that_file_goes_with_the_server() -> None:
    pytest.importorskip("bokeh", reason="the explorer needs bokeh")
    from nonsmooth.explorer.access import Access

    with Access().page_for_browser("http://127.0.0.1:9") as page:
        file = Path(urllib.parse.urlsplit(page).path)
        assert file.stat().st_mode & 0o777 == 0o600
    assert not file.exists()


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="programs as scripts, and Ctrl-C")
def test_ctrl_c_ends_the_server_and_takes_that_file_along(tmp_path: Path) -> None:
    pytest.importorskip("bokeh", reason="the explorer needs bokeh")
    server = Server(tmp_path)
    file = server.page_told()
    assert ask(server, f"/?token={server.token}")[0] == 200
    server.process.send_signal(signal.SIGINT)
    server.process.wait(60)
    assert not file.exists()


FREED = """
import signal
from tornado.ioloop import IOLoop
from nonsmooth.explorer.serve import run

class Page:
    def __del__(self):
        signal.raise_signal(signal.SIGINT)

signal.signal(signal.SIGINT, signal.default_int_handler)
loop, pages = IOLoop(), [Page()]
begun = loop.time()
loop.add_callback(pages.clear)
loop.call_later(30, loop.stop)
try:
    run(loop)
except KeyboardInterrupt:
    print("heard", signal.getsignal(signal.SIGINT) is signal.default_int_handler, loop.time() - begun < 30)
"""


def test_ctrl_c_is_heard_while_something_is_freed() -> None:
    """Python forgets an exception raised in ``__del__``: as a closed page is freed, Ctrl-C was lost. In a process of
    its own, since that of the tests may have a loop that runs."""
    pytest.importorskip("bokeh", reason="the explorer needs bokeh")
    done = subprocess.run([sys.executable, "-c", FREED], capture_output=True, text=True, timeout=120)
    assert done.stdout.split() == ["heard", "True", "True"], done.stderr
