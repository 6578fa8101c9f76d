"""What a command shown for curl sends; curl itself need not be installed."""

import argparse
import shlex
from typing import Any, NamedTuple

HERE = "http://localhost:8000"


class Sent(NamedTuple):
    """A request: arguments of a client's `request`, and the file that the answer would go to."""

    method: str
    path: str
    options: dict[str, Any]
    out: str | None


def sent(command: str) -> Sent:
    """The request of a command on one line or several."""
    words = argparse.ArgumentParser()
    words.add_argument("url")
    words.add_argument("-H", dest="headers", action="append", default=[])
    words.add_argument("-d", dest="data")
    words.add_argument("-o", dest="out")
    told = words.parse_args(shlex.split(command.replace("\\\n", " "))[1:])
    assert told.url.startswith(HERE)
    headers = dict(header.split(": ", 1) for header in told.headers)
    method = "GET" if told.data is None else "POST"
    return Sent(method, told.url.removeprefix(HERE), {"headers": headers, "content": told.data}, told.out)
