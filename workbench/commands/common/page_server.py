"""Who may ask: a browser on this machine, under the address that the command printed."""

import json
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from hmac import compare_digest
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from secrets import token_urlsafe
from typing import Any, cast

from ...base.errors import InputError

Answers = Mapping[str, Callable[[Mapping[str, Any]], dict[str, Any]]]
Files = Mapping[str, tuple[str, bytes]]
KINDS = {"js": "text/javascript; charset=utf-8", "css": "text/css; charset=utf-8", "html": "text/html; charset=utf-8"}
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; connect-src 'self'; img-src data: blob:; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_HOST = "127.0.0.1"
_MOST = 65536  # bytes of a request
_TIMEOUT = 60.0  # s: of a connection on which nothing comes
_HEADERS = {
    "Content-Security-Policy": POLICY,
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Cross-Origin-Resource-Policy": "same-origin",
}


class PageServer(ThreadingHTTPServer):
    """Serves one page to whoever has its token: `files`, kind and content by name, the page itself having none, and
    `answers` to what it posts, by name."""

    daemon_threads = True

    def __init__(self, files: Files, answers: Answers, port: int) -> None:
        super().__init__((_HOST, port), _Handler)
        self.token = token_urlsafe(24)
        self.host = f"{_HOST}:{self.server_address[1]}"
        self.files, self.answers, self._ended = files, answers, False

    @property
    def address(self) -> str:
        """The address of the page."""
        return f"http://{self.host}/{self.token}/"

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A browser that goes away while it is answered is no error, and what is not answered in the end is none."""
        if not (self._ended or isinstance(sys.exception(), ConnectionError | TimeoutError)):
            super().handle_error(request, client_address)

    def serve(self) -> None:
        """Print the address, and answer until Ctrl-C, which is raised."""
        print(f"{self.address} (Ctrl-C ends it)", flush=True)
        try:
            self.serve_forever(poll_interval=0.1)
        finally:
            self._ended = True


@contextmanager
def page_server(files: Files, answers: Answers, port: int, option: str = "--port") -> Iterator[PageServer]:
    """A server on 127.0.0.1; port 0 is a free one. Raises InputError for a port that cannot be had, which `option`
    gave."""
    try:
        server = PageServer(files, answers, port)
    except OSError as error:
        raise InputError(f"{option} {port}: {error.strerror}; choose another, or leave it out for a free one") from None
    with server:
        yield server


class _Handler(BaseHTTPRequestHandler):
    """GET gives the page, POST an answer; both only to the token's address on this host."""

    protocol_version, server_version, sys_version = "HTTP/1.1", "jackbench", ""
    disable_nagle_algorithm = True  # headers and body are two packets
    timeout = _TIMEOUT

    @property
    def _page(self) -> PageServer:
        return cast(PageServer, self.server)

    def do_GET(self) -> None:
        """The page and its files."""
        what = self._what()
        if what is not None and self._allowed() and what in self._page.files:
            self._send(200, *self._page.files[what])
        else:
            self._refuse()

    def do_POST(self) -> None:
        """An answer, to the page itself."""
        answer = self._page.answers.get(self._what() or "")
        own = self.headers.get("Origin") == f"http://{self._page.host}"
        if not (self._allowed() and own and answer):
            self._refuse()
            return
        asked = self._body()
        if asked is None:
            self._refuse(400)
            return
        try:
            status, table = 200, answer(asked)
        except InputError as error:
            status, table = 400, {"error": str(error)}
        except Exception:
            self._send(500, "text/plain; charset=utf-8", b"a fault of jackbench\n")
            raise
        content = json.dumps(table, allow_nan=False, separators=(",", ":")).encode()
        self._send(status, "application/json", content)

    def log_message(self, format: str, *args: Any) -> None:
        """Nothing: the terminal is the user's."""

    def _allowed(self) -> bool:
        """Under this host's own name: a name elsewhere that leads to this address is another site's."""
        return self.headers.get("Host") == self._page.host

    def _what(self) -> str | None:
        """The path behind the token; None without it."""
        _, token, *rest = (self.path + "/").split("/")
        if not compare_digest(token.encode(), self._page.token.encode()):
            return None
        return "/".join(rest).rstrip("/")

    def _body(self) -> Mapping[str, Any] | None:
        """The table that was sent; None for anything else."""
        length = self.headers.get("Content-Length", "")
        if not (length.isdecimal() and len(length) <= len(str(_MOST)) and int(length) <= _MOST):
            return None
        try:
            asked = json.loads(self.rfile.read(int(length)))
        except (ValueError, RecursionError):
            return None
        return asked if isinstance(asked, dict) else None

    def _refuse(self, status: int = 403) -> None:
        self.close_connection = True
        self._send(status, "text/plain; charset=utf-8", b"refused\n")

    def _send(self, status: int, kind: str, content: bytes) -> None:
        self.send_response(status)
        if self.close_connection:
            self.send_header("Connection", "close")
        for name, value in {**_HEADERS, "Content-Type": kind, "Content-Length": str(len(content))}.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(content)
