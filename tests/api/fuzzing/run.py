"""Sends a stream of requests to an application and looks at every answer."""

import asyncio
import json
from collections import Counter
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any, NoReturn
from urllib.parse import unquote

import click
import psutil
from fastapi import FastAPI

from fuzzing import hostile
from fuzzing.requests import Sent, Source
from phongbench_api.app import create_app
from phongbench_api.http import media as wire
from phongbench_api.http import problems
from phongbench_api.settings import Settings

#: requests under way at once
TOGETHER = 8
#: memory may grow by this share after the first fifth of the requests, when caches are full and kernels compiled
GROWTH = 0.1
_FAULTS_TOLD = 20


@dataclass
class Found:
    """What came back: answers by status, memory in bytes after the first fifth and at the end, and faults in words."""

    statuses: Counter[int] = field(default_factory=Counter)
    memory: list[int] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)

    @property
    def growth(self) -> float:
        """Memory at the end over that after the first fifth, less 1."""
        return self.memory[-1] / self.memory[0] - 1

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "requests": sum(self.statuses.values()),
            "statuses": dict(sorted(self.statuses.items())),
            "memory_growth": round(self.growth, 4),
            "faults": self.faults[:_FAULTS_TOLD],
        }


def fuzz(count: int, seed: int, runs: Path, *, app: FastAPI | None = None, progress: bool = False) -> Found:
    """Send `count` requests, TOGETHER at a time. An application that is given is warm already."""
    return asyncio.run(
        _fuzz(count, seed, app or create_app(Settings(runs=runs)), warm=app is not None, progress=progress)
    )


async def _fuzz(count: int, seed: int, app: FastAPI, *, warm: bool, progress: bool) -> Found:
    if not warm:
        app.state.service.warm_up()
    found, stream = Found(), iter(Source(app.openapi(), seed))
    every = max(1, count // 20)
    done = 0
    with click.progressbar(length=count, hidden=not progress) as bar:
        while done < count:
            batch = list(islice(stream, min(TOGETHER, count - done)))
            answers = await asyncio.gather(*(ask(app, sent) for sent in batch))
            for sent, (status, headers, body) in zip(batch, answers, strict=True):
                found.statuses[status] += 1
                found.faults += [
                    f"{fault}: {sent.method} {sent.path}?{sent.query[:200]} {sent.body[:100]!r}"
                    for fault in faults(status, headers, body)
                ]
            done += len(batch)
            bar.update(len(batch))
            if done >= count // 5 and (done // every > (done - len(batch)) // every or done == count):
                found.memory.append(psutil.Process().memory_info().rss)
    if found.growth > GROWTH:
        found.faults.append(f"memory grew by {found.growth:.1%}")
    return found


async def ask(app: FastAPI, sent: Sent) -> tuple[int, dict[str, str], bytes]:
    """What the application answers: status, headers, body. What it raises is a 500, as a server would make it."""
    messages: list[Any] = []
    gone = asyncio.Event()
    body = [{"type": "http.request", "body": sent.body, "more_body": False}]

    async def receive() -> Any:
        if body:
            return body.pop()
        await gone.wait()
        return {"type": "http.disconnect"}

    async def send(message: Any) -> None:
        messages.append(message)

    try:
        await app(_scope(sent), receive, send)
    except Exception as problem:  # noqa: BLE001 - finding out what is raised is the purpose
        return 500, {}, repr(problem).encode()
    started = next(message for message in messages if message["type"] == "http.response.start")
    headers = {name.decode("latin-1").lower(): value.decode("latin-1") for name, value in started["headers"]}
    return started["status"], headers, b"".join(m.get("body", b"") for m in messages[1:])


def faults(status: int, headers: dict[str, str], body: bytes) -> list[str]:
    """What is wrong with an answer, in words."""
    found = []
    media = headers.get("content-type", "")
    if status >= 500 and (status != 503 or "retry-after" not in headers):
        found.append(f"status {status} {body[:200]!r}")
    if status >= 400 and body and media != problems.MEDIA:
        found.append(f"a {status} that is no problem document")
    if media in (wire.JSON, problems.MEDIA) and body:
        try:
            json.loads(body, parse_constant=_refuse)
        except ValueError:
            found.append("JSON that is not strict")
    if hostile.MARK.encode() in body:
        found.append("an echo")
    if "content-security-policy" not in headers and status != 500:
        found.append("no security headers")
    return found


def _refuse(word: str) -> NoReturn:
    raise ValueError(word)


def _scope(sent: Sent) -> dict[str, Any]:
    given = {"host": "localhost"} | dict(sent.headers)
    headers = [(name.encode("latin-1"), value.encode("utf-8", "surrogatepass")) for name, value in given.items()]
    return {
        "type": "http",
        "asgi": {"version": "3.0"},
        "http_version": "1.1",
        "method": sent.method,
        "scheme": "http",
        "path": unquote(sent.path, errors="replace"),
        "raw_path": sent.path.encode("utf-8", "surrogatepass"),
        "root_path": "",
        "query_string": sent.query.encode(),
        "server": ("localhost", 80),
        "client": ("localhost", 1),
        "state": {},
        "headers": headers,
    }
