"""A service of two workers stands hostile clients and the death of a worker; the soak sees what is wrong."""

import asyncio
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from soaking.clients import PER_VISIT, Seen, answer, message
from soaking.service import PARTS, Found, soak
from soaking.tables import of_service

from fuzzing.requests import Sent

#: `PYTHONPATH=tests/soak:tests/api python -m soaking service` sends more
REQUESTS = 20 * PER_VISIT
GUARDED = {"content-security-policy": "x"}


def beside(call: Callable[..., Any], *given: Any) -> Any:
    """What a call gives, made in a thread: a browser of other tests may have an event loop in this one."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(call, *given).result()


def test_two_workers_answer_hostile_clients_survive_a_kill_and_leave_together(tmp_path: Path) -> None:
    found = beside(soak, REQUESTS, float("inf"), 1, tmp_path, print)
    assert found.faults == []
    assert found.clients.total() == REQUESTS
    assert found.clients["answered"] > REQUESTS / 2
    # all ways to behave and to be answered are there, or nothing would be proven
    assert {"vanished", "stalled"} < found.clients.keys()
    assert {200, 404, 405, 421, 422} < found.statuses.keys()
    assert found.replaced[0] > 0
    assert (found.exit_code, found.left) == (0, 0)


def read(data: bytes, *, head: bool = False) -> tuple[int, dict[str, str], bytes]:
    async def run() -> tuple[int, dict[str, str], bytes]:
        reader = asyncio.StreamReader()
        reader.feed_data(data)
        reader.feed_eof()
        return await answer(reader, head)

    return beside(asyncio.run, run())


@pytest.mark.parametrize(
    ("data", "head", "status", "body"),
    [
        (b"HTTP/1.1 200 OK\r\nContent-Length: 2\r\n\r\nabHTTP", False, 200, b"ab"),
        (b"HTTP/1.1 404 Not Found\r\nContent-Length: 2\r\n\r\n", True, 404, b""),
        (b"HTTP/1.1 400 Bad\r\nconnection: close\r\n\r\nno HTTP", False, 400, b"no HTTP"),
        (b"HTTP/1.1 304 Not Modified\r\netag: x\r\n\r\n", False, 304, b""),
        (b"HTTP/1.1 100 Continue\r\n\r\nHTTP/1.1 200 \r\ncontent-length: 0\r\n\r\n", False, 200, b""),
        (b"HTTP/1.1 200 \r\nTransfer-Encoding: chunked\r\n\r\n3\r\nabc\r\n2\r\nde\r\n0\r\n\r\n", False, 200, b"abcde"),
    ],
)  # fmt: skip
def test_an_answer_is_read_to_its_end_and_no_further(data: bytes, head: bool, status: int, body: bytes) -> None:
    assert read(data, head=head)[::2] == (status, body)


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"HTTP/1.1 200 OK\r\ncontent-le",
        b"HTTP/1.1 200 OK\r\ncontent-length: 2\r\n\r\na",
        b"HTTP/1.1 200 OK\r\ntransfer-encoding: chunked\r\n\r\n3\r\nabc\r\n",
        b"SMTP 200\r\n\r\n",
    ],
)
def test_what_is_cut_short_is_no_answer(data: bytes) -> None:
    with pytest.raises((EOFError, ValueError)):
        read(data)


def test_a_request_is_written_with_its_own_headers_last() -> None:
    sent = Sent("GET", "/v1/curve", "a=b", (("host", "evil.example"),), b"xy")
    assert message(sent) == b"GET /v1/curve?a=b HTTP/1.1\r\nhost: evil.example\r\n\r\nxy"
    assert b"connection: close" in message(sent, last=True)


def test_clients_may_be_cut_off_only_while_a_worker_is_killed() -> None:
    seen, sent = Seen(), Sent("GET", "/healthz")
    seen.cut_off = True
    seen.lost(sent, 3, EOFError())
    assert seen.faults == []
    seen.cut_off = False
    seen.lost(sent, 1, EOFError())
    assert "/healthz" in seen.faults[0]
    assert seen.clients["cut off"] == 4


def test_every_answer_is_looked_at() -> None:
    seen, sent = Seen(), Sent("GET", "/v1/runs")
    seen.answered(sent, 200, GUARDED | {"content-type": "application/json"}, b"[]")
    assert seen.faults == []
    seen.answered(sent, 500, GUARDED, b"")
    assert seen.statuses == Counter({200: 1, 500: 1})
    assert "status 500" in seen.faults[0]
    assert "/v1/runs" in seen.faults[0]


def well(**other: Any) -> Found:
    """What is seen of a service that stands all."""
    usual: dict[str, Any] = {
        "memory": {1: [50.0] * PARTS, 2: [300.0, 310.0, *[330.0] * 8], 3: [300.0, 310.0]},
        "clients": Counter(answered=10**6),
        "files": [20, 20],
        "replaced": [3.5],
        "exit_code": 0,
    }
    return Found(**usual | other)


@pytest.mark.parametrize(
    ("other", "fault"),
    [
        ({"memory": {1: [300.0, 310.0, 342.0]}}, "grew from 310.0 to 342.0 MiB"),
        ({"files": [20, 21]}, "20 files open, and hold 21"),
        ({"replaced": [float("inf")]}, "not replaced"),
        ({"exit_code": -9}, "exit code -9"),
        ({"left": 1}, "1 processes outlive"),
    ],
)
def test_each_bar_is_missed_by_what_it_forbids(other: dict[str, Any], fault: str) -> None:
    assert list(well().missed()) == []
    [told] = well(**other).missed()
    assert fault in told


def test_the_table_tells_requests_answers_and_processes() -> None:
    found = well(statuses=Counter({404: 1500, 200: 7}), clients=Counter(answered=1507, vanished=3))
    found.memory = {1: [50.0] * 3, 2: [300.0, 310.0, 320.0], 3: [290.0, 300.0, 301.0]}
    head, _, *lines = of_service(found.as_dict()).splitlines()
    assert head.startswith("| 1,510 requests |")
    assert lines[0] == "| answered | 1,507 |"
    assert lines[5:7] == ["| answers 200 | 7 |", "| answers 404 | 1,500 |"]
    assert "| MiB of a worker, early and at the end | 310, 320 |" in lines
    assert lines[-1] == "| faults | 0 |"
