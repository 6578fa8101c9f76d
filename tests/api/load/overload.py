"""More work than the service can do: how much it refuses, how long what it admits takes, whether health still answers.

First the capacity, by clients that each wait for their answer. Then an open loop: requests leave when they are due,
whether or not earlier ones came back, and their time counts from when they were due; so a server that stalls cannot
hide it. All over loopback, for a bounded time, with a bounded number of requests under way.
"""

import asyncio
import json
import math
import os
import sys
import time
from typing import Any

import numpy as np

from load.lines import Lines, Seen, due, head
from load.running import PROGRAMS
from phongbench_api.http import arrays
from phongbench_api.http import media as wire

#: points and lights of one request: some milliseconds of a core, half a megabyte of body, so that the cores are what is
#: short and not the one thread that moves bytes
POINTS, LIGHTS = 10_000, 128
_BOUNDARY = "phongbench-load"


def request_bytes(points: int = POINTS, lights: int = LIGHTS) -> bytes:
    """One `POST /v1/shade` as multipart, head and body: points all over a sphere under many lamps, in float64."""
    rng = np.random.default_rng(1)
    normals = rng.normal(size=(points, 3))
    normals = (normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype("<f8")
    lamps = [
        {"position": p, "attenuation": [1, 0.1, 0.01]} for p in (10 * rng.normal(size=(lights, 3))).round(3).tolist()
    ]
    material = {"ambient": [0.1] * 3, "diffuse": [0.5] * 3, "specular": [0.9] * 3, "shininess": 50}
    document = {
        "material": material,
        "lights": lamps,
        "viewer": {"position": [0, 0, 5]},
        "specular": {"approximation": "phong"},
    }
    body = b"".join(
        (
            f'--{_BOUNDARY}\r\nContent-Disposition: form-data; name="{name}"{more}\r\nContent-Type: {media}\r\n\r\n'
        ).encode()
        + content
        + b"\r\n"
        for name, more, media, content in (
            ("request", "", wire.JSON, json.dumps(document).encode()),
            ("vectors", '; filename="vectors.npy"', wire.NPY, arrays.npy_bytes(np.stack([normals, normals]))),
        )
    )
    body += f"--{_BOUNDARY}--\r\n".encode()
    media = f"Content-Type: multipart/form-data; boundary={_BOUNDARY}\r\nAccept: {wire.NPY}\r\n"
    return head("POST", "/v1/shade", f"{media}Content-Length: {len(body)}\r\n") + body


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
    until, statuses = time.perf_counter() + seconds, list[int]()

    async def client() -> None:
        while time.perf_counter() < until:
            statuses.append(await lines.ask(request))

    started = time.perf_counter()
    await asyncio.gather(*(client() for _ in range(2 * (os.cpu_count() or 1))))
    return statuses.count(200) / (time.perf_counter() - started)


async def _open(lines: Lines, request: bytes, rate: float, seconds: float) -> tuple[Seen, Seen]:
    """Requests at this rate, and looks at health meanwhile from a process of its own, which does not wait for them."""
    command = [sys.executable, "-m", "load.health", str(lines.port), str(seconds)]
    looking = await asyncio.create_subprocess_exec(*command, cwd=PROGRAMS, stdout=asyncio.subprocess.PIPE)
    work = await due(lines, request, 1 / rate, seconds)
    out, _ = await looking.communicate()
    return work, Seen([tuple(answer) for answer in json.loads(out)])


def _told(capacity: float, share: float, seconds: float, half: Seen, full: Seen, health: Seen) -> dict[str, Any]:
    """Plain data; None for what there was not.

    flat  the median time of what was admitted in the last third over that of the second third
    """
    third = seconds / 3
    middle, last = (full.quantile(0.5, 200, k * third, (k + 1) * third) for k in (1, 2))
    found = {
        "capacity_per_s": capacity,
        "share": share,
        "requests": len(full.answers),
        "left_out": full.left_out,
        "refused": full.share(503),
        "broken": full.share(0),
        "other": 1 - full.share(200) - full.share(503) - full.share(0),
        "half_p50_ms": half.quantile(0.5, 200),
        "half_p99_ms": half.quantile(0.99, 200),
        "admitted_p50_ms": full.quantile(0.5, 200),
        "admitted_p99_ms": full.quantile(0.99, 200),
        "flat": last / middle,
        "refused_p50_ms": full.quantile(0.5, 503),
        "refused_p99_ms": full.quantile(0.99, 503),
        "health_p50_ms": health.quantile(0.5, 200),
        "health_p99_ms": health.quantile(0.99, 200),
        "health_failed": 1 - health.share(200),
    }
    return {name: value if math.isfinite(value) else None for name, value in found.items()}
