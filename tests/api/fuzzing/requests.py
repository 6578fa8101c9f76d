"""Random requests: by the OpenAPI document, by the hostile corpus, and by mutation; equal seeds give equal requests."""

import json
import random
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import quote

from fuzzing import hostile


@dataclass(frozen=True, slots=True)
class Sent:
    """One request."""

    method: str
    path: str
    query: str = ""
    headers: tuple[tuple[str, str], ...] = ()
    body: bytes = b""


@dataclass
class Source:
    """An endless stream of requests to the operations of a document.

    Where a value is right, it is often one of few: kernels for every setting would take minutes to compile.
    """

    document: Mapping[str, Any]
    seed: int
    draw: random.Random = field(init=False)
    operations: list[tuple[str, str, Mapping[str, Any]]] = field(init=False)

    def __post_init__(self) -> None:
        self.draw = random.Random(self.seed)
        paths = self.document["paths"].items()
        self.operations = [
            (path, method.upper(), found) for path, members in paths for method, found in members.items()
        ]

    def __iter__(self) -> Iterator[Sent]:
        while True:
            yield self.one()

    def one(self) -> Sent:
        """The next request."""
        draw = self.draw
        path, method, operation = draw.choice(self.operations)
        query, place = [], path
        for parameter in operation.get("parameters", ()):
            if parameter["in"] == "path":
                place = place.replace(
                    "{" + parameter["name"] + "}", _quoted(self._value(parameter), draw.choice(("", "/%")))
                )
            elif parameter.get("required") or draw.random() < 0.4:
                query += [(parameter["name"], self._value(parameter))] * draw.choice((1, 1, 1, 1, 2))
        if draw.random() < 0.05:
            query.append((draw.choice(hostile.WORDS), draw.choice(hostile.WORDS)))
        text = "&".join(f"{_quoted(name)}={_quoted(value)}" for name, value in query)
        body, kind = self._body(operation) if "requestBody" in operation or draw.random() < 0.02 else (b"", "")
        headers = [("content-type", kind)] * bool(kind) + [("content-length", str(len(body)))] * bool(body)
        if draw.random() < 0.3:
            headers.append(("accept", draw.choice(hostile.ACCEPTS)))
        if draw.random() < 0.05:
            headers.append(draw.choice(hostile.HEADERS))
        odd = draw.random() < 0.02
        return Sent(
            draw.choice(("PUT", "DELETE", "HEAD", "OPTIONS", "X")) if odd else method, place, text, tuple(headers), body
        )

    def _value(self, parameter: Mapping[str, Any]) -> str:
        draw = self.draw
        if draw.random() < 0.15:
            return draw.choice(hostile.WORDS)
        if parameter["name"] == "run" and draw.random() < 0.9:
            return "latest"
        if parameter["name"] == "precision":
            return "float32"
        return str(self._by_schema(parameter["schema"]))

    def _by_schema(self, schema: Mapping[str, Any]) -> Any:
        draw = self.draw
        if "anyOf" in schema:
            return self._by_schema(schema["anyOf"][0])
        if schema.get("examples") and draw.random() < 0.8:
            return draw.choice(schema["examples"])
        if "enum" in schema:
            return draw.choice([8, 8, 8, 3] if 256 in schema["enum"] else schema["enum"])
        if schema.get("type") in ("number", "integer"):
            low, high = schema.get("minimum", 0), schema.get("maximum", 100)
            return draw.choice([low, low - 1, min(high, 50), (low + min(high, 100)) // 2, high + 1])
        if schema.get("type") == "boolean":
            return draw.choice(("true", "false"))
        return draw.choice(hostile.WORDS)

    def _body(self, operation: Mapping[str, Any]) -> tuple[bytes, str]:
        draw = self.draw
        content = operation.get("requestBody", {}).get("content", {})
        examples = [about["example"] for about in content.values() if "example" in about]
        if examples and draw.random() < 0.6:
            return self._mutated(examples[0]), "application/json"
        kind = draw.choice(list(hostile.BODIES))
        body = draw.choice(hostile.BODIES[kind])
        if body and draw.random() < 0.3:
            at, noise = draw.randrange(len(body)), draw.randbytes(draw.choice((1, 2, 8)))
            body = body[:at] + noise + body[at + draw.choice((0, len(noise))) :]
        return body, kind

    def _mutated(self, example: Any) -> bytes:
        """The example with a few of its members changed, left out or doubled, as JSON - perhaps cut short."""
        draw, document = self.draw, json.loads(json.dumps(example))
        for _ in range(draw.choice((0, 1, 1, 2, 4))):
            self._spoil(document)
        text = json.dumps(document, allow_nan=True).encode("utf-8", "replace")
        return text[: draw.randrange(len(text))] if draw.random() < 0.1 else text

    def _spoil(self, document: Any) -> None:
        draw, node = self.draw, document
        while True:
            keys = list(node) if isinstance(node, dict) else list(range(len(node)))
            if not keys:
                return
            key = draw.choice(keys)
            if isinstance(node[key], dict | list) and node[key] and draw.random() < 0.7:
                node = node[key]
                continue
            break
        odd: tuple[Any, ...] = (
            None,
            True,
            -1,
            0,
            1e308,
            float("nan"),
            float("inf"),
            10**400,
            "",
            [],
            {},
            [[]],
            hostile.MARK,
            1e-320,
            3,
            [1, 2],
        )
        if isinstance(node, dict) and draw.random() < 0.2:
            del node[key]
        elif isinstance(node, list) and draw.random() < 0.3:
            node.extend(node[:1] * draw.choice((1, 50)))
        else:
            node[key] = draw.choice(odd)


def _quoted(text: str, safe: str = "") -> str:
    return quote(text.encode("utf-8", "surrogatepass"), safe=safe)
