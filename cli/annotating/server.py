"""The page over HTTP, to this machine alone and to who knows the token in its address."""

import json
import secrets
import threading
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from typing import Any
from urllib.parse import urlsplit

from ...core.errors import InputError, MuslinError
from .session import Session, StaleError

#: What the page is made of, and how a browser is told so.
_PARTS = {
    "": ("annotate.html", "text/html; charset=utf-8"),
    "annotate.css": ("annotate.css", "text/css; charset=utf-8"),
    "annotate_model.js": ("annotate_model.js", "text/javascript; charset=utf-8"),
    "annotate_view.js": ("annotate_view.js", "text/javascript; charset=utf-8"),
    "annotate.js": ("annotate.js", "text/javascript; charset=utf-8"),
}
#: Most bytes of a post; a hundred keypoints need a tenth of it.
_LARGEST_POST = 100_000
_OWN_HOSTS = ("127.0.0.1", "localhost")


class AnnotationServer(ThreadingHTTPServer):
    """Serves one session on a free port of 127.0.0.1 until the page says that it is done.

    Args:
        session: that is served.
        next_command: shown on the page when it is done.
    """

    daemon_threads = True

    def __init__(self, session: Session, next_command: str) -> None:
        self.session = session
        self.next_command = next_command
        self.token = secrets.token_urlsafe(16)
        super().__init__(("127.0.0.1", 0), _Handler)

    @property
    def url(self) -> str:
        """The address of the page."""
        return f"http://127.0.0.1:{self.server_address[1]}/{self.token}/"

    def stop(self) -> None:
        """End :meth:`serve_forever` soon; may be called while a request is answered."""
        threading.Thread(target=self.shutdown).start()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A browser that went away is no error; what is wrong with a request is answered to the page."""


class _Handler(BaseHTTPRequestHandler):
    server: AnnotationServer
    protocol_version = "HTTP/1.1"
    timeout = 60

    def do_GET(self) -> None:
        path = self._path()
        if path is None:
            return
        if path in _PARTS:
            name, kind = _PARTS[path]
            self._answer(HTTPStatus.OK, (files("muslin.cli") / "templates" / name).read_bytes(), kind)
        elif path == "state":
            self._json(HTTPStatus.OK, {**self.server.session.state(), "next": self.server.next_command})
        elif path.startswith("frame/") and path.endswith(".png") and path[6:-4].isdecimal():
            try:
                data = self.server.session.picture(int(path[6:-4]))
            except MuslinError as error:
                status = HTTPStatus.NOT_FOUND if isinstance(error, InputError) else HTTPStatus.INTERNAL_SERVER_ERROR
                self._json(status, {"error": str(error)})
            else:  # a frame never changes while this token lasts
                self._answer(HTTPStatus.OK, data, "image/png", "private, max-age=86400, immutable")
        else:
            self._json(HTTPStatus.NOT_FOUND, {"error": "there is no such page"})

    def do_POST(self) -> None:
        path = self._path()
        if path is None:
            return
        try:
            posted = self._body()
            if path == "points":
                self._json(HTTPStatus.OK, {"version": self.server.session.change(posted)})
            elif path == "done":
                self._json(HTTPStatus.OK, {})
                self.server.stop()
            else:
                self._json(HTTPStatus.NOT_FOUND, {"error": "there is no such page"})
        except StaleError as error:
            self._json(HTTPStatus.CONFLICT, {"error": str(error), "frame": error.frame})
        except InputError as error:
            self._json(HTTPStatus.BAD_REQUEST, {"error": str(error)})
        except MuslinError as error:
            self._json(HTTPStatus.INTERNAL_SERVER_ERROR, {"error": str(error)})

    def _path(self) -> str | None:
        """What is asked for below the token; None if the request was refused.

        The host is checked so that no foreign name that resolves to this machine can be used to read the pages.
        """
        _, token, *rest = [*urlsplit(self.path).path.split("/"), ""]
        host = urlsplit(f"//{self.headers.get('Host', '')}").hostname
        known = secrets.compare_digest(token.encode(), self.server.token.encode())
        if not known or host not in _OWN_HOSTS:
            self.close_connection = True
            self._json(HTTPStatus.NOT_FOUND, {"error": "open the address that muslin annotate printed"})
            return None
        return "/".join(rest[:-1])

    def _body(self) -> bytes:
        length = self.headers.get("Content-Length", "")
        if not length.isdecimal() or int(length) > _LARGEST_POST:
            self.close_connection = True  # what follows is not read, so it cannot be the next request
            raise InputError(f"a post needs a Content-Length of at most {_LARGEST_POST} bytes")
        body = self.rfile.read(int(length))
        if self.headers.get_content_type() != "application/json":  # which no foreign page may send unasked
            raise InputError("a post must be application/json")
        if len(body) < int(length):
            raise InputError("the post was cut off")
        return body

    def _json(self, status: HTTPStatus, value: dict[str, Any]) -> None:
        self._answer(status, json.dumps(value).encode(), "application/json")

    def _answer(self, status: HTTPStatus, data: bytes, kind: str, cache: str = "no-store") -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(data)))
        self.send_header("Cache-Control", cache)
        self.send_header("Referrer-Policy", "no-referrer")
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("Content-Security-Policy", "default-src 'self'; img-src 'self' data:; frame-ancestors 'none'")
        self.end_headers()
        self.wfile.write(data)

    def log_message(self, format: str, *args: Any) -> None:
        """Requests are not worth a line."""
