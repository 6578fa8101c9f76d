"""The marked parts of README.md: `<!-- generated: NAME -->` ... `<!-- /generated: NAME -->`, and only those change."""

import re
from collections.abc import Mapping
from pathlib import Path

from phongbench.errors import InputError

NAMES = (
    "verdict", "front", "shader", "claims", "speed", "raw", "peers", "alarms", "throughput", "scenes", "service",
    "machine",
)  # fmt: skip
README = "README.md"
#: bytes a picture may have: a repository keeps every version of it
LARGEST_PICTURE = 100_000
_PART = re.compile(r"(<!-- generated: (?P<name>\w+) -->\n)(?P<body>.*?)(<!-- /generated: (?P=name) -->)", re.DOTALL)


def read(root: Path) -> str:
    """The README of a checkout; InputError where there is none."""
    try:
        return (root / README).read_text(encoding="utf-8")
    except OSError as problem:
        raise InputError(f"cannot be read: {problem.strerror}", str(root / README), "run it in a checkout") from problem


def parts_of(text: str) -> dict[str, str]:
    """The generated parts of a text, name to body; InputError unless it holds each of NAMES once and no other."""
    parts = [(part["name"], part["body"].strip()) for part in _PART.finditer(text)]
    if sorted(name for name, _ in parts) != sorted(NAMES):
        there = ", ".join(name for name, _ in parts) or "none"
        raise InputError(f"the generated parts are {there}", README, f"keep the marks of {', '.join(NAMES)}, each once")
    return dict(parts)


def filled(text: str, bodies: Mapping[str, str]) -> str:
    """The text with its generated parts replaced; all else stays as it is."""
    parts_of(text)
    return _PART.sub(lambda part: f"{part[1]}\n{bodies[part['name']].strip()}\n\n{part[4]}", text)


def problems(root: Path) -> list[str]:
    """What README and pictures lack: empty parts, and pictures that are absent or too large."""
    text = read(root)
    lacking = [f"the part {name} is empty" for name, body in parts_of(text).items() if not body]
    for name in sorted(set(re.findall(r'(?:src|srcset)="([^"]+)"', text))):
        file = root / name
        if not file.is_file():
            lacking.append(f"{name} is shown but does not exist")
        elif file.stat().st_size > LARGEST_PICTURE:
            lacking.append(f"{name} has {file.stat().st_size} bytes, more than {LARGEST_PICTURE}")
    return lacking
