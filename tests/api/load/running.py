"""A server of its own process, as long as it is measured."""

import http.client
import re
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from phongbench.errors import PhongbenchError

#: seconds until the server must be ready: a cold cache of kernels takes some 20
_READY_WITHIN = 120.0
#: the folder that `python -m` finds this package from, whatever the path of the process that measures
PROGRAMS = Path(__file__).resolve().parents[1]


@contextmanager
def server(runs: Path) -> Iterator[int]:
    """The port of a server on 127.0.0.1 that is ready; it ends with the block."""
    command = [sys.executable, "-m", "load.server", str(runs.resolve())]
    with subprocess.Popen(command, cwd=PROGRAMS, stderr=subprocess.PIPE, text=True) as process:
        try:
            assert process.stderr is not None
            port = _port(process.stderr)
            threading.Thread(target=process.stderr.read, daemon=True).start()  # a full pipe would stop the server
            _wait(port)
            yield port
        finally:
            process.terminate()


def _port(talk: IO[str]) -> int:
    """The port that the server says it listens on."""
    heard = []
    for line in talk:
        heard.append(line)
        found = re.search(r"http://127\.0\.0\.1:(\d+)/", line)
        if found:
            return int(found[1])
    raise PhongbenchError(f"the server did not start: {''.join(heard)[-2000:]}", "load.server")


def _wait(port: int) -> None:
    until = time.monotonic() + _READY_WITHIN
    while time.monotonic() < until:
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
        connection.request("GET", "/readyz")
        if connection.getresponse().status == 200:
            return
        connection.close()
        time.sleep(0.1)
    raise PhongbenchError(f"the server was not ready within {_READY_WITHIN:g} s", f"127.0.0.1:{port}")
