"""Clients of the service over sockets of their own: patient ones, and such as vanish, stall and send in pieces."""

import asyncio
import random
import re
from collections import Counter
from collections.abc import AsyncIterator, Iterator, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass, field

from fuzzing import hostile
from fuzzing.requests import Sent, Source
from fuzzing.run import faults

#: requests that a patient client sends at once over one connection, and then reads the answers
TOGETHER = 45
#: clients with one request each, between two patient ones
_SINGLE = 5
#: requests of a patient client and of those after it
PER_VISIT = TOGETHER + _SINGLE
#: of a hundred of those so many vanish once they have sent all, stall in the middle, or send in small pieces
_VANISH, _STALL, _TRICKLE = 10, 10, 10
#: seconds: of a stall; until a client gives up whose request never ends; until any other gives up, which is a fault
_STALLS, _SHORT, _PATIENCE = 0.2, 1.0, 300.0
#: what the protocol itself answers to what is no HTTP, before the application sees it
_NO_HTTP = b"Invalid HTTP request received."
_STATUS = re.compile(rb"HTTP/1\.1 (\d{3}) ?[^\r]*")
#: headers that end the connection, or leave the server waiting for a body that does not come
_ENDING = ("content-length", "transfer-encoding", "expect")


@dataclass
class Seen:
    """What clients saw.

    statuses  of answers
    clients   how requests fared: answered, or their client vanished, stalled, gave up, or was cut off
    faults    in words
    cut_off   may clients be cut off now: is a worker killed meanwhile?
    """

    statuses: Counter[int] = field(default_factory=Counter)
    clients: Counter[str] = field(default_factory=Counter)
    faults: list[str] = field(default_factory=list)
    cut_off: bool = False

    def answered(self, sent: Sent, status: int, headers: dict[str, str], body: bytes) -> None:
        """Count an answer, and look at it."""
        self.clients["answered"] += 1
        self.statuses[status] += 1
        if body != _NO_HTTP:
            self.faults += [f"{fault}: {_shown(sent)}" for fault in faults(status, headers, body)]

    def lost(self, sent: Sent, count: int, problem: Exception) -> None:
        """Count requests that nothing was answered to."""
        self.clients["cut off"] += count
        if not self.cut_off:
            self.faults.append(f"no answer, {problem!r}: {_shown(sent)}")


def _shown(sent: Sent) -> str:
    return f"{sent.method} {sent.path}?{sent.query[:200]} {dict(sent.headers)} {sent.body[:100]!r}"


@dataclass
class Requests:
    """An endless stream for many clients: what is cheap to answer over one connection, anything by clients of its own.

    A part of what is cheap is hostile: words that no path, parameter or header has, by way of the corpus.
    """

    source: Source
    draw: random.Random

    def __post_init__(self) -> None:
        plain = ("/healthz", "/readyz", "/v1/formulas/lyon", "/v1/runs", "/favicon.svg", "/v1/meta", "/")
        headers = [header for header in hostile.HEADERS if header[0] not in _ENDING]
        words = [_escaped(word) for word in hostile.WORDS if len(word) < 1000]
        self._cheap = [Sent("GET", path) for path in plain[:3] for _ in range(8)]
        self._cheap += [Sent("GET", path) for path in plain[3:]] + [Sent("HEAD", path) for path in plain]
        self._cheap += [Sent("GET", "/healthz", headers=(header,)) for header in headers]
        self._cheap += [Sent("GET", f"/v1/{word}") for word in words]
        self._cheap += [Sent("GET", "/v1/curve", f"approximation={word}") for word in words]
        self._cheap += [Sent(method, "/v1/curve") for method in ("PUT", "DELETE", "OPTIONS", "X")]
        self._bytes = [message(sent) for sent in self._cheap]

    def visit(self) -> list[tuple[Sent, bytes]]:
        """The requests of one patient client, and their bytes."""
        chosen = self.draw.choices(range(len(self._cheap)), k=TOGETHER)
        return [(self._cheap[one], self._bytes[one]) for one in chosen]

    def alone(self) -> Sent:
        """Any request."""
        return self.source.one()


async def client(port: int, requests: Requests, counts: Iterator[int], seen: Seen) -> None:
    """One client after another: a patient one with many requests, then some with one each, while counts come."""
    for _ in counts:
        await _visit(port, requests.visit(), seen)
        for _ in range(_SINGLE):
            await _single(port, requests.alone(), requests.draw.randrange(100), seen)


async def _visit(port: int, wanted: Sequence[tuple[Sent, bytes]], seen: Seen) -> None:
    """Send all over one connection, then read an answer to each."""
    done = 0
    try:
        async with asyncio.timeout(_PATIENCE), _connected(port) as (reader, writer):
            writer.writelines(data for _, data in wanted)
            for sent, _ in wanted:
                seen.answered(sent, *await answer(reader, sent.method == "HEAD"))
                done += 1
    except (OSError, ValueError, EOFError) as problem:  # TimeoutError is an OSError
        seen.lost(wanted[done][0], len(wanted) - done, problem)


async def _single(port: int, sent: Sent, kind: int, seen: Seen) -> None:
    """A client with one request, which behaves by its kind, 0 to 99."""
    endless = any(name == "transfer-encoding" for name, _ in sent.headers)
    try:
        if kind < _VANISH + _STALL:
            await _leave(port, message(sent), vanishes=kind < _VANISH)
            seen.clients["vanished" if kind < _VANISH else "stalled"] += 1
            return
        async with asyncio.timeout(_SHORT if endless else _PATIENCE), _connected(port) as (reader, writer):
            data = message(sent, last=True)
            for at in range(0, min(len(data), 210), 7) if kind < _VANISH + _STALL + _TRICKLE else ():
                writer.write(data[at : at + 7])
                await asyncio.sleep(0)
            writer.write(data[210:] if kind < _VANISH + _STALL + _TRICKLE else data)
            seen.answered(sent, *await answer(reader, sent.method == "HEAD"))
    except (OSError, ValueError, EOFError) as problem:
        if endless and isinstance(problem, TimeoutError):
            seen.clients["gave up"] += 1
        else:
            seen.lost(sent, 1, problem)


async def _leave(port: int, data: bytes, *, vanishes: bool) -> None:
    """A client that never reads: it sends all and goes, or half and waits a while before it goes."""
    async with _connected(port) as (_, writer):
        writer.write(data if vanishes else data[: len(data) // 2])
        await asyncio.sleep(0 if vanishes else _STALLS)


async def asked(port: int, sent: Sent) -> tuple[int, dict[str, str], bytes]:
    """Status, headers and body of the answer to one request."""
    async with asyncio.timeout(_PATIENCE), _connected(port) as (reader, writer):
        writer.write(message(sent, last=True))
        return await answer(reader, sent.method == "HEAD")


def message(sent: Sent, *, last: bool = False) -> bytes:
    """The request as bytes.

    last  the connection is to end with its answer
    """
    given = {"host": "localhost"} | ({"connection": "close"} if last else {}) | dict(sent.headers)
    target = sent.path + f"?{sent.query}" * bool(sent.query)
    lines = [f"{sent.method} {target} HTTP/1.1", *(f"{name}: {value}" for name, value in given.items()), "", ""]
    return "\r\n".join(lines).encode("utf-8", "surrogatepass") + sent.body


@asynccontextmanager
async def _connected(port: int) -> AsyncIterator[tuple[asyncio.StreamReader, asyncio.StreamWriter]]:
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    try:
        yield reader, writer
    finally:
        writer.transport.abort()


async def answer(reader: asyncio.StreamReader, head: bool) -> tuple[int, dict[str, str], bytes]:
    """Status, headers and body of the next answer; EOFError or ValueError where it is none, or not whole.

    head  the request was HEAD: no body follows
    """
    first, *lines = (await reader.readuntil(b"\r\n\r\n"))[:-4].split(b"\r\n")
    if not (told := _STATUS.fullmatch(first)):
        raise ValueError(f"no answer: {first[:100]!r}")
    status = int(told[1])
    if status < 200:  # 100 Continue
        return await answer(reader, head)
    headers = {
        name.lower(): value.strip() for name, _, value in (one.decode("latin-1").partition(":") for one in lines)
    }
    if head or status in (204, 304):
        return status, headers, b""
    if headers.get("transfer-encoding") == "chunked":
        return status, headers, await _chunks(reader)
    return status, headers, await reader.readexactly(int(headers["content-length"]))


async def _chunks(reader: asyncio.StreamReader) -> bytes:
    """A body that comes in chunks."""
    body = b""
    while size := int(await reader.readuntil(b"\r\n"), 16):
        body += (await reader.readexactly(size + 2))[:-2]
    await reader.readexactly(2)
    return body


def _escaped(word: str) -> str:
    return "".join(f"%{byte:02x}" for byte in word.encode("utf-8", "surrogatepass"))
