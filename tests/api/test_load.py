"""The load program: what it counts, that its echo is an echo, and that a whole short measurement comes out."""

import asyncio
import json
import math
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest
from starlette.testclient import TestClient

from load import overload, paired
from load.__main__ import markdown
from load.lines import Lines, Seen
from load.running import PROGRAMS
from load.server import echoing
from phongbench.errors import PhongbenchError
from phongbench.timing.statistics import MIN_ROUNDS
from phongbench_api import serve
from phongbench_api.app import create_app
from phongbench_api.settings import Settings


def test_the_echo_answers_the_first_bytes_and_the_service_has_none(runs: Path) -> None:
    settings = Settings(runs=runs)
    body = bytes(range(256)) * 1000
    with TestClient(echoing(settings), base_url="http://localhost") as client:
        answer = client.post("/echo?answer=5000", content=body)
    assert answer.content == body[:5000]
    with TestClient(create_app(settings), base_url="http://localhost") as client:
        assert client.post("/echo?answer=5000", content=body).status_code == 404


def test_answers_on_a_kept_connection_do_not_wait_for_acknowledgements() -> None:
    with serve._listen(Settings(port=0)) as listening, socket.create_connection(listening.getsockname()):
        accepted, _ = listening.accept()
        with accepted:
            assert accepted.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)


def test_quantiles_are_of_one_status_and_one_span() -> None:
    seen = Seen([(0.0, 0.010, 200), (1.0, 0.030, 200), (1.5, 0.001, 503), (2.0, 0.050, 200), (2.5, 9.0, 0)])
    assert seen.quantile(0.5, 200) == pytest.approx(30)
    assert seen.quantile(1.0, 503) == pytest.approx(1)
    assert seen.quantile(1.0, 200, 0.5, 2.0) == pytest.approx(30)
    assert math.isnan(seen.quantile(0.5, 404))
    assert seen.share(200) == 0.6


@contextmanager
def scripted(answers: list[bytes]) -> Iterator[int]:
    """A server that gives these answers, one for each request, over one connection at a time."""

    def work() -> None:
        with listening:
            connection, _ = listening.accept()
            for answer in answers:
                connection.recv(1 << 16)
                connection.sendall(answer)
            connection.close()

    listening = socket.create_server(("127.0.0.1", 0))
    thread = threading.Thread(target=work)
    thread.start()
    yield listening.getsockname()[1]
    thread.join()


def test_a_line_that_the_server_closed_meanwhile_is_not_used_again() -> None:
    ok = b"HTTP/1.1 200 OK\r\nContent-Length: 3\r\n\r\nabc"

    async def run(first: int, second: int) -> tuple[int, int]:
        lines = Lines(first)
        before = await lines.ask(b"x")
        while not lines._idle[0][0].at_eof():
            await asyncio.sleep(0.001)
        lines.port = second
        after = await lines.ask(b"x")
        lines.close()
        return before, after

    with scripted([ok]) as first, scripted([ok]) as second:
        assert asyncio.run(run(first, second)) == (200, 200)


def test_lines_are_kept_and_one_that_breaks_is_counted() -> None:
    ok = b"HTTP/1.1 200 OK\r\nContent-Length: 3\r\n\r\nabc"
    busy = b"HTTP/1.1 503 Busy\r\ncontent-length: 0\r\n\r\n"

    async def ask(port: int) -> list[int]:
        lines = Lines(port)
        found = [await lines.ask(b"GET / HTTP/1.1\r\n\r\n") for _ in range(4)]
        lines.close()
        return found

    with scripted([ok, busy, ok, ok[:-1]]) as port:
        assert asyncio.run(ask(port)) == [200, 503, 200, 0]


def test_clients_that_wait_are_counted_all_together() -> None:
    class Busy(Lines):
        async def ask(self, request: bytes) -> int:
            await asyncio.sleep(0)
            asked.append(request)
            return 200 if len(asked) % 2 else 503

    asked: list[bytes] = []
    rate = asyncio.run(overload._closed(Busy(0), b"", 0.05))
    assert rate * 0.05 <= (len(asked) + 1) / 2 <= rate * 10


def test_what_there_was_not_is_told_as_none() -> None:
    nothing = Seen()
    told = overload._told(10.0, 1.5, 3.0, nothing, Seen([(0.0, 0.1, 503)]), nothing)
    assert told["refused"] == 1
    assert told["admitted_p50_ms"] is told["flat"] is None
    assert "| admitted | none |" in markdown({"paired": [], "overload": told})


def test_an_answer_that_is_no_success_ends_the_paired_measurement() -> None:
    with (
        scripted([b"HTTP/1.1 422 No\r\nContent-Length: 4\r\n\r\nwhy?"]) as port,
        closing(paired.Line(port)) as line,
        pytest.raises(PhongbenchError, match=r"422.*why"),
    ):
        line.seconds(paired.Ask("GET", "/healthz"))


def test_a_short_measurement_has_every_number(runs: Path) -> None:
    wishes = ["--runs", str(runs), "--rounds", str(MIN_ROUNDS), "--seconds", "3", "--json"]
    command = [sys.executable, "-m", "load", *wishes]
    found = json.loads(subprocess.run(command, cwd=PROGRAMS, check=True, capture_output=True, text=True).stdout)
    assert len(found["paired"]) == 3
    assert all(0 < row["ratio_low"] <= row["ratio"] <= row["ratio_high"] for row in found["paired"])
    overloaded = found["overload"]
    assert overloaded["capacity_per_s"] > 0
    assert overloaded["other"] == pytest.approx(0)
    assert overloaded["health_failed"] == 0
    assert 0 <= overloaded["refused"] < 1
    table = markdown(found)
    assert len(table.splitlines()) == 5 + 1 + 10
    assert "exact Phong" in table
