"""Writes the examples of answers that /docs shows: what a server answers to each documented request, cut short.

    PYTHONPATH=tests/api python -m answer_examples RUNS [RUNS ...]

asks about the first run that has what is asked for, and writes api/phongbench_api/examples.json.
"""

import argparse
import json
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from starlette.testclient import TestClient

from phongbench_api.app import create_app
from phongbench_api.http import media
from phongbench_api.http.openapi import ASK
from phongbench_api.settings import Settings

#: how many numbers, words and other things of a list are shown
NUMBERS, WORDS, THINGS = 7, 4, 2
#: operations whose examples stand beside their routes: those of the requests that they answer
ELSEWHERE = ("healthz_healthz_get", "readyz_readyz_get", "specular", "shade", "render")


def requests(document: Mapping[str, Any]) -> Iterator[tuple[str, str, str, dict[str, Any]]]:
    """Operation, method, path with query, and options of a client, of every documented request for JSON."""
    for path, members in document["paths"].items():
        for method, operation in members.items():
            if media.JSON in operation["responses"]["200"]["content"]:
                body = operation.get("requestBody", {}).get("content", {}).get(media.JSON, {}).get("example")
                options = {} if body is None else {"json": body}
                headers = {"accept": media.JSON}
                yield operation["operationId"], method, operation.get(ASK, path), {**options, "headers": headers}


def key(operation: str) -> str:
    """What the example of an operation is stored under."""
    return operation.partition("_v1_")[0]


def cut(value: Any) -> Any:
    """The value with its long lists, and its objects of many equal members, cut short."""
    if isinstance(value, list):
        plain = not any(isinstance(one, list | dict) for one in value)
        most = THINGS if not plain else WORDS if any(isinstance(one, str) for one in value) else NUMBERS
        return [cut(one) for one in value[:most]]
    if isinstance(value, dict):
        alike = len(value) > 2 * THINGS and all(isinstance(one, dict | list) and one for one in value.values())
        nested = alike and not any(isinstance(one, list) and isinstance(one[0], str) for one in value.values())
        return {name: cut(one) for name, one in list(value.items())[: THINGS if nested else None]}
    return value


def examples(folders: list[Path]) -> dict[str, Any]:
    """The answer to each documented request by the first folder's newest run that gives one."""
    found: dict[str, Any] = {}
    for folder in folders:
        with TestClient(create_app(Settings(runs=folder)), base_url="http://localhost") as client:
            client.app.state.service.warm.wait(600)
            for operation, method, address, options in requests(client.get("/openapi.json").json()):
                if key(operation) not in (*found, *ELSEWHERE):
                    answer = client.request(method, address, **options)
                    if answer.status_code == 200 and answer.json().get("rows", True):
                        found[key(operation)] = cut(answer.json())
                    else:
                        sys.stderr.write(f"{operation}: {answer.status_code}\n")
    return found


def main() -> None:
    """Write the file."""
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("runs", nargs="+", type=Path)
    target = Path(__file__).parents[2] / "api" / "phongbench_api" / "examples.json"
    found = json.loads(target.read_text()) | examples(words.parse_args().runs)
    lines = (f" {json.dumps(name)}: {json.dumps(one, separators=(',', ':'))}" for name, one in sorted(found.items()))
    target.write_text("{\n" + ",\n".join(lines) + "\n}\n")


if __name__ == "__main__":
    main()
