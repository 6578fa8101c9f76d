"""Requests over kept connections, sent when they are due whether or not earlier ones came back. Nothing but asyncio, so
that the process which looks at health starts at once.
"""

import asyncio
import time
from dataclasses import dataclass, field

#: requests under way at most
TOGETHER = 1000
_Line = tuple[asyncio.StreamReader, asyncio.StreamWriter]


def head(method: str, path: str, more: str = "") -> bytes:
    """The head of a request; `more` are further header lines, each with its line break."""
    return f"{method} {path} HTTP/1.1\r\nHost: 127.0.0.1\r\n{more}\r\n".encode()


class Lines:
    """Connections that are kept, one for each request under way."""

    def __init__(self, port: int) -> None:
        self.port, self._idle = port, list[_Line]()

    async def ask(self, request: bytes) -> int:
        """The status of the answer, all of which is read; 0 where the connection broke."""
        line = None
        try:
            line = self._kept() or await asyncio.open_connection("127.0.0.1", self.port)
            line[1].write(request)
            answered = (await line[0].readuntil(b"\r\n\r\n")).lower()
            length = answered.partition(b"content-length:")[2].partition(b"\r\n")[0]
            await line[0].readexactly(int(length))
            if b"connection: close" not in answered:
                self._idle.append(line)
                line = None
            return int(answered[9:12])
        except (OSError, asyncio.IncompleteReadError, ValueError):
            return 0
        finally:
            if line is not None:
                line[1].close()

    def _kept(self) -> _Line | None:
        """A connection that the server has not closed meanwhile, as it does after some idle seconds."""
        while self._idle:
            reader, writer = self._idle.pop()
            if not reader.at_eof():
                return reader, writer
            writer.close()
        return None

    def close(self) -> None:
        """Close what is kept."""
        for _, writer in self._idle:
            writer.close()


@dataclass
class Seen:
    """Answers: (seconds from the beginning to when they were due, from then until they came, status).

    left_out  requests that were not sent, since TOGETHER were under way
    """

    answers: list[tuple[float, float, int]] = field(default_factory=list)
    left_out: int = 0

    def quantile(self, q: float, status: int, first: float = 0.0, last: float = float("inf")) -> float:
        """Milliseconds within which this share of the answers with this status came, of those due in a span."""
        took = sorted(seconds for due, seconds, got in self.answers if got == status and first <= due < last)
        return 1e3 * took[min(len(took) - 1, int(q * len(took)))] if took else float("nan")

    def share(self, status: int) -> float:
        """The share of answers with this status."""
        return sum(got == status for _, _, got in self.answers) / max(1, len(self.answers))


async def due(lines: Lines, request: bytes, every: float, seconds: float) -> Seen:
    """Send a request every so many seconds, for so many seconds; what came back. Time counts from when one was due."""
    seen, under_way, started = Seen(), set[asyncio.Task[None]](), time.perf_counter()

    async def one(moment: float) -> None:
        status = await lines.ask(request)
        seen.answers.append((moment - started, time.perf_counter() - moment, status))

    for k in range(int(seconds / every)):
        moment = started + k * every
        await asyncio.sleep(max(0.0, moment - time.perf_counter()))
        if len(under_way) >= TOGETHER:
            seen.left_out += 1
            continue
        task = asyncio.create_task(one(moment))
        under_way.add(task)
        task.add_done_callback(under_way.discard)
    await asyncio.gather(*under_way)
    return seen
