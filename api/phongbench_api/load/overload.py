"""More work than the service can do: how much it refuses, how long what it admits takes, whether health still answers.

First the capacity, by clients that each wait for their answer. Then an open loop: requests leave when they are due,
whether or not earlier ones came back, and their time counts from when they were due; so a server that stalls cannot
hide it. All over loopback, for a bounded time, with a bounded number of requests under way.
"""

import asyncio
import json
import os
import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from phongbench_api import wire

#: points and lights of one request: a few milliseconds of a core, a megabyte of body
POINTS, LIGHTS = 40_000, 64
#: requests under way at most, and seconds between two looks at health
TOGETHER, HEALTH_EVERY = 1000, 0.02
_BOUNDARY = "phongbench-load"


def request_bytes(points: int = POINTS, lights: int = LIGHTS) -> bytes:
    """One `POST /v1/shade` as multipart, head and body: coherent points of a sphere under many lamps."""
    rng = np.random.default_rng(1)
    normals = rng.normal(size=(points, 3))
    normals = (normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype("<f4")
    lamps = [
        {"position": p, "attenuation": [1, 0.1, 0.01]} for p in (10 * rng.normal(size=(lights, 3))).round(3).tolist()
    ]
    material = {"ambient": [0.1] * 3, "diffuse": [0.5] * 3, "specular": [0.9] * 3, "shininess": 50}
    document = {
        "material": material, "lights": lamps, "viewer": {"position": [0, 0, 5]},
        "specular": {"approximation": "lyon", "lambda": "dot", "gamma": 8},
    }  # fmt: skip
    body = b"".join(
        (
            f'--{_BOUNDARY}\r\nContent-Disposition: form-data; name="{name}"{more}\r\n'
            f"Content-Type: {media}\r\n\r\n"
        ).encode() + content + b"\r\n"
        for name, more, media, content in (
            ("request", "", wire.JSON, json.dumps(document).encode()),
            ("vectors", '; filename="vectors.npy"', wire.NPY, wire.npy_bytes(np.stack([normals, normals]))),
        )
    )  # fmt: skip
    body += f"--{_BOUNDARY}--\r\n".encode()
    media = f"Content-Type: multipart/form-data; boundary={_BOUNDARY}\r\nAccept: {wire.NPY}\r\n"
    return _head("POST", "/v1/shade", f"{media}Content-Length: {len(body)}\r\n") + body


def _head(method: str, path: str, more: str = "") -> bytes:
    return f"{method} {path} HTTP/1.1\r\nHost: 127.0.0.1\r\n{more}\r\n".encode()


HEALTH = _head("GET", "/healthz")


class Lines:
    """Connections that are kept, one for each request under way."""

    def __init__(self, port: int) -> None:
        self._port, self._idle = port, list[tuple[asyncio.StreamReader, asyncio.StreamWriter]]()

    async def ask(self, request: bytes) -> int:
        """The status of the answer, all of which is read; 0 where the connection broke."""
        line = None
        try:
            line = self._idle.pop() if self._idle else await asyncio.open_connection("127.0.0.1", self._port)
            line[1].write(request)
            head = (await line[0].readuntil(b"\r\n\r\n")).lower()
            length = head.partition(b"content-length:")[2].partition(b"\r\n")[0]
            await line[0].readexactly(int(length))
            if b"connection: close" not in head:
                self._idle.append(line)
                line = None
            return int(head[9:12])
        except (OSError, asyncio.IncompleteReadError, ValueError):
            return 0
        finally:
            if line is not None:
                line[1].close()

    def close(self) -> None:
        """Close what is kept."""
        for _, writer in self._idle:
            writer.close()


@dataclass
class Seen:
    """Answers: (when they were due, seconds since then, status)."""

    answers: list[tuple[float, float, int]] = field(default_factory=list)
    left_out: int = 0

    def quantile(self, q: float, status: int, first: float = 0.0, last: float = np.inf) -> float:
        """Milliseconds within which this share of the answers with this status came, of those due in a span."""
        took = [seconds for due, seconds, got in self.answers if got == status and first <= due < last]
        return float(1e3 * np.quantile(took, q)) if took else float("nan")

    def share(self, status: int) -> float:
        """The share of answers with this status."""
        return sum(got == status for _, _, got in self.answers) / max(1, len(self.answers))


def overload(port: int, seconds: float, share: float = 1.5) -> dict[str, Any]:
    """Capacity in requests a second, then what happens at this share of it; see `_told`."""
    return asyncio.run(_overload(port, seconds, share))


async def _overload(port: int, seconds: float, share: float) -> dict[str, Any]:
    lines, request = Lines(port), request_bytes()
    try:
        await _closed(lines, request, seconds / 8)
        capacity = await _closed(lines, request, seconds / 2)
        half, _ = await _open(lines, request, 0.5 * capacity, seconds / 2)
        full, health = await _open(lines, request, share * capacity, seconds)
    finally:
        lines.close()
    return _told(capacity, share, seconds, half, full, health)


async def _closed(lines: Lines, request: bytes, seconds: float) -> float:
    """Answers a second by clients that wait, twice as many as there are cores."""
    until, done = time.perf_counter() + seconds, 0

    async def client() -> None:
        nonlocal done
        while time.perf_counter() < until:
            done += await lines.ask(request) == 200

    started = time.perf_counter()
    await asyncio.gather(*(client() for _ in range(2 * (os.cpu_count() or 1))))
    return done / (time.perf_counter() - started)


async def _open(lines: Lines, request: bytes, rate: float, seconds: float) -> tuple[Seen, Seen]:
    """Requests at this rate, and looks at health beside them."""
    work, health = Seen(), Seen()
    started = time.perf_counter()
    await asyncio.gather(
        _due(lines, request, 1 / rate, started, seconds, work),
        _due(lines, HEALTH, HEALTH_EVERY, started, seconds, health),
    )
    return work, health


async def _due(lines: Lines, request: bytes, every: float, started: float, seconds: float, seen: Seen) -> None:
    under_way: set[asyncio.Task[None]] = set()

    async def one(due: float) -> None:
        status = await lines.ask(request)
        seen.answers.append((due - started, time.perf_counter() - due, status))

    for k in range(int(seconds / every)):
        due = started + k * every
        await asyncio.sleep(max(0.0, due - time.perf_counter()))
        if len(under_way) >= TOGETHER:
            seen.left_out += 1
            continue
        task = asyncio.create_task(one(due))
        under_way.add(task)
        task.add_done_callback(under_way.discard)
    await asyncio.gather(*under_way)


def _told(capacity: float, share: float, seconds: float, half: Seen, full: Seen, health: Seen) -> dict[str, Any]:
    """Plain data. `flat`: the median wait of what was admitted in the last third over that of the second third."""
    third = seconds / 3
    middle, last = (full.quantile(0.5, 200, k * third, (k + 1) * third) for k in (1, 2))
    return {
        "capacity_per_s": capacity, "share": share, "requests": len(full.answers), "left_out": full.left_out,
        "refused": full.share(503), "broken": full.share(0),
        "other": 1 - full.share(200) - full.share(503) - full.share(0),
        "half_p50_ms": half.quantile(0.5, 200), "half_p99_ms": half.quantile(0.99, 200),
        "admitted_p50_ms": full.quantile(0.5, 200), "admitted_p99_ms": full.quantile(0.99, 200), "flat": last / middle,
        "refused_p50_ms": full.quantile(0.5, 503), "refused_p99_ms": full.quantile(0.99, 503),
        "health_p50_ms": health.quantile(0.5, 200), "health_p99_ms": health.quantile(0.99, 200),
        "health_failed": 1 - health.share(200),
    }  # fmt: skip
