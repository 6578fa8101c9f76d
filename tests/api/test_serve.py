"""Servers in processes of their own: how they stop, whom they cut off, and that they call nobody."""

import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx2 as httpx
import numpy as np
import psutil
import pytest
from click.testing import CliRunner

from phongbench.cli.main import main
from phongbench_api.http import media
from phongbench_api.serve import from_environment
from phongbench_api.settings import Settings

QUERY = {"approximation": "lyon", "lambda": "cross", "gamma": "8", "alpha": "50"}
get = partial(httpx.get, timeout=600)  # a busy machine is no fault


def connected(url: str) -> socket.socket:
    parts = urlsplit(url)
    made = socket.create_connection((parts.hostname, parts.port), timeout=600)
    made.settimeout(600)
    return made


def test_a_signal_ends_it_with_exit_code_0(serve: Callable[..., Any]) -> None:
    server = serve()
    assert get(f"{server.url}/readyz").status_code == 200
    assert server.stop(signal.SIGINT) == 0


#: a server of two workers that cannot make their application, or compile what it needs
BROKEN = """
from pathlib import Path
import phongbench_api.serve as module

def fail(*_):
    raise RuntimeError("broken on purpose")

if __name__ == "__main__":
    module.HEALTHCHECK = 20
    module.serve(module.Settings(port=0, workers=2, runs=Path("none")))
elif {application}:
    module.create_app = fail
else:
    from phongbench_api.work.warm_kernels import Kernels
    Kernels.warm = fail
"""


@pytest.mark.parametrize("application", [True, False], ids=["application", "kernels"])
def test_workers_that_cannot_start_end_the_server_and_say_why(application: bool, tmp_path: Path) -> None:
    script = tmp_path / "broken.py"  # its workers run it too, under another name
    script.write_text(BROKEN.format(application=application))
    ended = subprocess.run(
        [sys.executable, script], cwd=tmp_path, capture_output=True, text=True, timeout=600, check=False
    )
    assert ended.returncode == 1
    assert "a worker could not start" in ended.stderr
    assert "broken on purpose" in ended.stderr


def test_at_sigterm_a_request_under_way_finishes_and_new_ones_are_refused(serve: Callable[..., Any]) -> None:
    server = serve("--drain", "1")
    body = np.zeros((2, 1000, 3), "<f4").tobytes()
    query = "&".join(f"{k}={v}" for k, v in QUERY.items())
    head = f"POST /v1/specular?{query} HTTP/1.1\r\nHost: localhost\r\nContent-Type: {media.OCTETS}\r\n"
    head += f"Content-Length: {len(body)}\r\n\r\n"
    with connected(server.url) as slow:
        slow.sendall(head.encode() + body[:-1])
        # an answer to another request proves that the first head was read: one loop reads both in turn
        assert get(f"{server.url}/readyz").status_code == 200
        server.process.send_signal(signal.SIGTERM)
        while (ready := get(f"{server.url}/readyz")).status_code == 200:
            pass
        assert ready.status_code == 503
        assert (
            httpx.post(
                f"{server.url}/v1/specular",
                params=QUERY,
                content=body,
                headers={"content-type": media.OCTETS},
                timeout=600,
            ).status_code
            == 503
        )
        slow.sendall(body[-1:])
        answer = slow.makefile("rb").read()
    assert answer.startswith(b"HTTP/1.1 200")
    assert len(answer.partition(b"\r\n\r\n")[2]) == 4 * 1000
    assert server.process.wait(600) == 0


def test_a_head_that_trickles_is_cut_off(serve: Callable[..., Any]) -> None:
    server = serve(head_seconds=1.0)
    with connected(server.url) as slow:
        slow.sendall(b"GET /healthz HT")
        assert slow.recv(100) == b""
    with connected(server.url) as again:  # the second head of a connection that was answered once
        again.sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n")
        answered = b""
        while not answered.endswith(b'{"status":"ok"}'):
            answered += again.recv(10_000)
        again.sendall(b"GET /he")
        assert again.recv(100) == b""
    assert get(f"{server.url}/healthz").status_code == 200


def test_it_calls_nobody(server: Any) -> None:
    process = psutil.Process(server.process.pid)
    for path in ("/", "/docs", "/openapi.json", "/v1/runs", "/v1/curve?approximation=phong&alpha=50", "/v1/meta"):
        assert get(server.url + path).status_code == 200
    port = urlsplit(server.url).port
    kept = [c for c in process.net_connections() if c.laddr.port != port]
    assert kept == []


def test_a_port_that_is_taken_is_said_in_two_lines() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        found = CliRunner().invoke(main, ["serve", "--port", str(taken.getsockname()[1])])
    assert found.exit_code == 2
    assert "cannot listen" in found.output
    assert "--port" in found.output


def test_a_worker_gets_the_settings_of_its_parent(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    import json
    from dataclasses import asdict

    settings = Settings(runs=tmp_path, allowed_hosts=("a", "b"), cors=("http://a",), workers=2, drain_seconds=3.0)
    monkeypatch.setenv("PHONGBENCH_SERVE", json.dumps(asdict(settings), default=str))
    assert from_environment().state.service.settings == settings


def test_many_large_requests_leave_health_answering(server: Any) -> None:
    body = np.zeros((2, 200_000, 3), "<f4").tobytes()
    statuses: list[int] = []

    def ask() -> None:
        with httpx.Client(timeout=600) as client:
            answer = client.post(
                f"{server.url}/v1/specular", params=QUERY, content=body, headers={"content-type": media.OCTETS}
            )
            statuses.append(answer.status_code)

    threads = [threading.Thread(target=ask) for _ in range(40)]
    for thread in threads:
        thread.start()
    health = [get(f"{server.url}/healthz").status_code for _ in range(20)]
    for thread in threads:
        thread.join()
    assert set(health) == {200}
    assert set(statuses) <= {200, 503}
    assert 200 in statuses
