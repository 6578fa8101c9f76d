"""The options of a server. Every limit stands here, and `/v1/meta` lists them all."""

import ipaddress
import os
from dataclasses import dataclass, field
from pathlib import Path

from phongbench.results.runs import DEFAULT_ROOT

_MIB = 1 << 20
#: names that a browser on this machine may use for a server that listens on loopback only
LOOPBACK = ("localhost", "127.0.0.1", "::1")


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@dataclass(frozen=True, slots=True)
class Settings:
    """Where the runs are, which hosts are answered for, and how much a request may take.

    runs             folder of the runs; read only
    host, port       where to listen
    workers          processes; each has its own kernels and admits work for its share of the cores
    allowed_hosts    names a request's Host may have, besides those of loopback; empty on a bind that is not loopback:
                     any name
    cors             origins whose pages may read answers, such as http://localhost:8888 of a notebook; none: no other
    cores            kernels that may run at once in this process
    max_body         bytes of a binary or multipart body
    max_json         bytes of a JSON body: parsing holds the interpreter, about 10 ms a MiB, and health waits for it
    max_points       pairs or points of a request
    max_json_points  pairs or points of an answer in JSON: writing it holds the interpreter, too
    max_lights       lights of a shading request
    max_pixels       of a picture
    max_scene        bytes of a request for one: a scene is read value by value, about 1 s of a core a MiB
    max_triangles    of the meshes of a scene that is sent
    max_rows         rows of an answer
    max_cost         predicted seconds that one request may take
    max_wait         predicted seconds that a request may have to wait for a core; beyond, 503 with Retry-After
    max_reading      bytes of bodies that may be on their way in at once
    inline_cost      predicted seconds up to which work is done at once: a hop to a thread costs about 0.2 ms
    head_seconds     for the head of a request to arrive
    read_seconds     for its body
    write_seconds    for a client to take the next piece of an answer
    drain_seconds    between SIGTERM, when `/readyz` turns 503, and closing the listening socket
    table_bytes      memory for columns of runs
    """

    runs: Path = DEFAULT_ROOT
    host: str = "127.0.0.1"
    port: int = 8000
    workers: int = 1
    allowed_hosts: tuple[str, ...] = ()
    cors: tuple[str, ...] = ()
    cores: int = field(default_factory=_cores)
    max_body: int = 64 * _MIB
    max_json: int = 4 * _MIB
    max_points: int = 2_000_000
    max_json_points: int = 100_000
    max_lights: int = 256
    max_pixels: int = 4 * _MIB
    max_scene: int = _MIB // 4
    max_triangles: int = 250_000
    max_rows: int = 50_000
    max_cost: float = 10.0
    max_wait: float = 0.5
    max_reading: int = 128 * _MIB
    inline_cost: float = 2e-4
    head_seconds: float = 10.0
    read_seconds: float = 30.0
    write_seconds: float = 30.0
    drain_seconds: float = 0.0
    table_bytes: int = 256 * _MIB

    @property
    def hosts(self) -> tuple[str, ...] | None:
        """The names a request's Host may have, lower case; None: any.

        A bind to loopback without a check could be read by any web page that lets its own name resolve to 127.0.0.1.
        """
        named = tuple(name.lower() for name in self.allowed_hosts)
        return (*LOOPBACK, *named) if named or is_loopback(self.host) else None


def is_loopback(host: str) -> bool:
    """True if only this machine can reach a server that listens there."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host.lower() == "localhost"
