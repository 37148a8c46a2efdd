"""``muslin annotate`` as a process, and a browser's part in it."""

import contextlib
import json
import os
import re
import signal
import subprocess
import sys
from http.client import HTTPConnection
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit


class Page:
    """A process of the command that serves ``v.zarr`` of a folder, and posts to it."""

    def __init__(self, folder: Path, *options: str) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "muslin.cli", "annotate", "v.zarr", "-o", "k.json", "--no-browser", *options],
            cwd=folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, "PYTHONUNBUFFERED": "1"},
            # the jobs that a shell puts in the background, as of CI, are deaf to Ctrl-C, and so is what they start
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        )
        assert self.process.stdout is not None
        self.told = ""
        while (found := re.search(r"http://\S+/", self.told)) is None:
            line = self.process.stdout.readline()
            assert line, self.process.communicate()
            self.told += line
        self.url = urlsplit(found[0])

    def ask(self, path: str = "", method: str = "GET", body: str | None = None, **headers: str) -> tuple[int, bytes]:
        assert self.url.port is not None
        connection = HTTPConnection("127.0.0.1", self.url.port, timeout=20)
        with contextlib.closing(connection):
            connection.request(method, path if path.startswith("/") else self.url.path + path, body, headers)
            answer = connection.getresponse()
            return answer.status, answer.read()

    def post(self, frame: Any, version: Any, *points: Any) -> tuple[int, dict[str, Any]]:
        table = [{"u": p[0], "v": p[1], "flag": p[2]} for p in points]
        body = json.dumps({"frame": frame, "version": version, "points": table})
        status, answer = self.ask("points", "POST", body, **{"Content-Type": "application/json"})
        return status, json.loads(answer)

    def state(self) -> dict[str, Any]:
        return dict(json.loads(self.ask("state")[1]))

    def end(self, sent: signal.Signals | None = None) -> tuple[int, str, str]:
        if sent is not None:
            self.process.send_signal(sent)
        out, error = self.process.communicate(timeout=20)
        return self.process.returncode, out, error
