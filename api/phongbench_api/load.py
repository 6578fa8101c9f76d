"""`python -m phongbench_api.load`: how fast the service is beside an echo of the same bytes, and what it does when it
has too much to do. Loopback only, bounded in time; `make bench-api` runs it on a quiet machine.
"""

import http.client
import io
import json
import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from statistics import median
from typing import Any
from urllib.parse import urlsplit

import click
import numpy as np

PAIRS, ROUNDS, SMALL_ROUNDS = 1_000_000, 25, 400
POINTS, LIGHTS = 20_000, 128
QUERY = "approximation=lyon&lambda=cross&gamma=8&alpha=50"
ONE = json.dumps(
    {"approximation": "lyon", "lambda": "cross", "gamma": 8, "alpha": 50, "a": [[0, 0, 1]], "b": [[0, 0, 1]]}
)
OCTETS, JSON = {"content-type": "application/octet-stream"}, {"content-type": "application/json"}
#: load of the overload part, as a share of what the cores can do
OVERLOAD = 1.5
_SERVE = "from phongbench_api.serve import Settings, serve; serve(Settings(port=0, echo=True))"


@dataclass
class Seen:
    """Latencies in seconds of what was answered, by status."""

    latencies: dict[int, list[float]] = field(default_factory=dict)
    lock: threading.Lock = field(default_factory=threading.Lock)

    def add(self, status: int, seconds: float) -> None:
        """One answer."""
        with self.lock:
            self.latencies.setdefault(status, []).append(seconds)


@contextmanager
def server() -> Iterator[tuple[str, int]]:
    """A server of its own process, with the echo; its host and port."""
    process = subprocess.Popen([sys.executable, "-c", _SERVE], stderr=subprocess.PIPE, text=True)
    try:
        assert process.stderr
        url = urlsplit(process.stderr.readline().split("serves ")[1].split(" ")[0])
        while "ready" not in (line := process.stderr.readline()):
            if not line:
                raise click.ClickException("the server ended before it was ready")
        yield str(url.hostname), int(url.port or 0)
    finally:
        process.terminate()
        process.wait()


def connection(place: tuple[str, int]) -> http.client.HTTPConnection:
    """A connection that stays open, without Nagle's delay."""
    made = http.client.HTTPConnection(*place, timeout=60)
    made.connect()
    made.sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return made


def ask(
    to: http.client.HTTPConnection, method: str, path: str, body: Any = None, headers: Any = None
) -> tuple[int, float]:
    """Status, and seconds until the last byte."""
    started = time.perf_counter()
    to.request(method, path, body, headers or {})
    answer = to.getresponse()
    answer.read()
    return answer.status, time.perf_counter() - started


def beside(one: Callable[[], float], other: Callable[[], float], rounds: int) -> dict[str, float]:
    """Medians of two, taken in turn, and the median of their ratios."""
    for run in (one, other):
        run()
    taken = [(one(), other()) if i % 2 else tuple(reversed((other(), one()))) for i in range(rounds)]
    return {
        "ms": 1e3 * median(a for a, _ in taken), "beside_ms": 1e3 * median(b for _, b in taken),
        "ratio": median(a / b for a, b in taken),
    }  # fmt: skip


def throughput(place: tuple[str, int]) -> dict[str, float]:
    """PAIRS pairs of float32 as octets, beside an echo of the same bytes in and out."""
    to, body = connection(place), np.random.default_rng(1).random((2, PAIRS, 3), np.float32).tobytes()
    return beside(
        lambda: ask(to, "POST", f"/v1/specular?{QUERY}", body, OCTETS)[1],
        lambda: ask(to, "POST", f"/echo?size={4 * PAIRS}", body, OCTETS)[1],
        ROUNDS,
    )


def latency(place: tuple[str, int]) -> dict[str, float]:
    """One pair as JSON, beside `/healthz`."""
    to = connection(place)
    return beside(
        lambda: ask(to, "POST", "/v1/specular", ONE, JSON)[1], lambda: ask(to, "GET", "/healthz")[1], SMALL_ROUNDS
    )


def scene() -> tuple[bytes, str]:
    """A form of few bytes and much work: POINTS points under LIGHTS lights. The body and its content type."""
    vectors = np.zeros((2, POINTS, 3), "<f4")
    vectors[0, :, :2], vectors[1, :, 2] = np.random.default_rng(1).random((POINTS, 2)), 1.0
    white = [1.0, 1.0, 1.0]
    request = {
        "material": {"ambient": white, "diffuse": white, "specular": white, "shininess": 50},
        "lights": [{"position": [x / LIGHTS, 0.5, 1.0]} for x in range(LIGHTS)],
        "viewer": {"position": [0.5, 0.5, 5.0]},
    }  # fmt: skip
    file = io.BytesIO()
    np.save(file, vectors)
    head = b'--x\r\nContent-Disposition: form-data; name="%s"\r\n\r\n%s\r\n'
    parts = head % (b"request", json.dumps(request).encode()) + head % (b"vectors", file.getvalue())
    return parts + b"--x--\r\n", "multipart/form-data; boundary=x"


def overload(place: tuple[str, int], seconds: float) -> dict[str, Any]:
    """Requests at a fixed rate, OVERLOAD times what the cores can answer, whether or not answers come back."""
    (body, kind), to = scene(), connection(place)
    path, headers = "/v1/shade", {"content-type": kind}
    alone = median(ask(to, "POST", path, body, headers)[1] for _ in range(10))
    cores = len(os.sched_getaffinity(0))
    pause, seen, health, until = alone / cores / OVERLOAD, Seen(), Seen(), time.monotonic() + seconds

    def one() -> None:
        seen.add(*ask(connection(place), "POST", path, body, headers))

    def watch() -> None:
        to = connection(place)
        while time.monotonic() < until:
            health.add(*ask(to, "GET", "/healthz"))
            time.sleep(0.01)

    asking = [threading.Thread(target=watch)]
    asking[0].start()
    due = time.monotonic()
    while due < until:
        time.sleep(max(0.0, due - time.monotonic()))
        asking.append(threading.Thread(target=one))
        asking[-1].start()
        due += pause
    for thread in asking:
        thread.join()
    told = {f"p{p}_ms": 1e3 * float(np.percentile(seen.latencies.get(200, [np.nan]), p)) for p in (50, 99)}
    counts = {str(status): len(found) for status, found in sorted(seen.latencies.items())}
    return {
        "rate": 1 / pause, "alone_ms": 1e3 * alone, **told, "answers": counts,
        "health_p99_ms": 1e3 * float(np.percentile(health.latencies[200], 99)),
    }  # fmt: skip


@click.command()
@click.option("--seconds", type=click.FloatRange(1, 120), default=10.0, show_default=True, help="Of the overload.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
def main(seconds: float, as_json: bool) -> None:
    """Measure the service over loopback: bytes beside an echo, one pair beside /healthz, and an overload."""
    with server() as place:
        found = {"throughput": throughput(place), "latency": latency(place), "overload": overload(place, seconds)}
    if as_json:
        click.echo(json.dumps(found, indent=2))
        return
    bulk, small, much = found["throughput"], found["latency"], found["overload"]
    click.echo("| request | median | beside | ratio |\n|---|--:|--:|--:|")
    click.echo(
        f"| {PAIRS:,} pairs as octets | {bulk['ms']:.1f} ms | echo {bulk['beside_ms']:.1f} ms | {bulk['ratio']:.2f} |"
    )
    click.echo(
        f"| one pair as JSON | {small['ms']:.2f} ms | /healthz {small['beside_ms']:.2f} ms | {small['ratio']:.2f} |"
    )
    click.echo(
        f"\n{OVERLOAD:.0%} of capacity, {much['rate']:.0f} requests/s: answers {much['answers']}; admitted "
        f"p50 {much['p50_ms']:.0f} ms, p99 {much['p99_ms']:.0f} ms; /healthz p99 {much['health_p99_ms']:.1f} ms"
    )


if __name__ == "__main__":
    main()
