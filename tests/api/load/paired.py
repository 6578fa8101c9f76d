"""Two kinds of requests in turn over one connection: what the one takes as a multiple of the other."""

import http.client
import json
import time
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from phongbench.compiler.lowering import FLOAT32
from phongbench.errors import PhongbenchError
from phongbench.inputs import pairs
from phongbench.inputs.strata import STRATA
from phongbench.timing.interleaved import interleaved

#: pairs of the large request
PAIRS = 1_000_000
_SEED = 1


@dataclass(frozen=True)
class Ask:
    """A request: method, path, body, content type."""

    method: str
    path: str
    body: bytes = b""
    media: str = "application/octet-stream"


class Line:
    """One connection that stays open."""

    def __init__(self, port: int) -> None:
        self._connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
        self._room = bytearray(1 << 16)

    def close(self) -> None:
        """Close it."""
        self._connection.close()

    def seconds(self, ask: Ask) -> float:
        """What a request takes from its first byte out to its last byte in. PhongbenchError unless it succeeds."""
        started = time.perf_counter()
        headers = {"Content-Type": ask.media} if ask.body else {}
        self._connection.request(ask.method, ask.path, ask.body or None, headers)
        answer = self._connection.getresponse()
        size = answer.length or 0
        if size > len(self._room):
            self._room = bytearray(size)
        view = memoryview(self._room)[:size]
        while view:
            view = view[answer.readinto(view) :]
        took = time.perf_counter() - started
        answer.close()
        if answer.status != 200:
            raise PhongbenchError(f"status {answer.status}: {bytes(self._room[:300])!r}", ask.path)
        return took


def moving(port: int, rounds: int) -> list[dict[str, Any]]:
    """`POST /v1/specular` with a million pairs in float32 against an echo of as many bytes in and out."""
    stratum = next(s for s in STRATA if s.name == "highlight")
    a, b = pairs.pairs(stratum, FLOAT32, seed=_SEED, start=0, count=PAIRS, scale=1 / 50)
    body = np.ascontiguousarray(np.stack([a.T, b.T]), "<f4").tobytes()
    echo = Ask("POST", f"/echo?answer={4 * PAIRS}", body)
    lyon = Ask("POST", "/v1/specular?approximation=lyon&lambda=dot&gamma=8&alpha=50&dtype=f4", body)
    phong = Ask("POST", "/v1/specular?approximation=phong&alpha=50&dtype=f4", body)
    return [
        {"what": f"{name}, {PAIRS:,} pairs as octets / echo of the same bytes", **_in_turn(port, ask, echo, rounds)}
        for name, ask in (("Lyon gamma 8", lyon), ("exact Phong", phong))
    ]


def latency(port: int, rounds: int) -> list[dict[str, Any]]:
    """One pair as JSON against `/healthz`."""
    asked = {"approximation": "lyon", "lambda": "dot", "gamma": 8, "alpha": 50, "a": [[0, 0, 1]], "b": [[0.6, 0, 0.8]]}
    one = Ask("POST", "/v1/specular", json.dumps(asked).encode(), "application/json")
    return [{"what": "one pair as JSON / GET /healthz", **_in_turn(port, one, Ask("GET", "/healthz"), rounds)}]


def _in_turn(port: int, ask: Ask, base: Ask, rounds: int) -> dict[str, Any]:
    """Medians of both in milliseconds, and `Times.row` of the one over the other."""
    with closing(Line(port)) as line:
        calls = {"ask": partial(line.seconds, ask), "base": partial(line.seconds, base)}
        times = interleaved(calls, rounds=rounds, warm=max(3, rounds // 10))
    medians = {"ms": 1e3 * times.median("ask"), "base_ms": 1e3 * times.median("base")}
    return medians | times.row("ask", "base")
