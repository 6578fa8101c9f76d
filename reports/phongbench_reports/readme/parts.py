"""The marked parts of README.md and of the guide, `<!-- generated: NAME -->` ... `<!-- /generated: NAME -->`.

Only those change.
"""

import os
import re
from collections.abc import Mapping
from pathlib import Path

from phongbench.errors import InputError

README = "README.md"
DOCS = "reports/docs"
#: the parts that `make soak` and `make mutate` write, by page; `make docs` writes all others
SOAKED, MUTATED = ("disk_faults", "kills", "attacked", "cluster_kills"), ("mutations", "survivors")
ATTACKED = dict.fromkeys(SOAKED, "soak") | dict.fromkeys(MUTATED, "mutate")
#: page -> its generated parts
PAGES: Mapping[str, tuple[str, ...]] = {
    README: ("goals", "pictures", "targets", "raw_answer", "glossary"),
    f"{DOCS}/code.md": ("shader",),
    f"{DOCS}/columns.md": ("columns",),
    f"{DOCS}/inverse.md": ("heads",),
    f"{DOCS}/speed.md": ("verdict", "speed", "raw", "peers", "rooflines", "alarms", "throughput", "times", "machine"),
    f"{DOCS}/claims.md": ("claims",),
    f"{DOCS}/studies.md": SOAKED[:2],
    f"{DOCS}/soaks.md": (*MUTATED, *SOAKED[2:]),
    f"{DOCS}/pictures.md": ("scenes",),
    f"{DOCS}/scale.md": ("predicted",),
    f"{DOCS}/service.md": ("service",),
}
NAMES = tuple(name for names in PAGES.values() for name in names)
#: bytes a picture may have: a repository keeps every version of it
LARGEST_PICTURE = 150_000
_PART = re.compile(r"(<!-- generated: (?P<name>\w+) -->\n)(?P<body>.*?)(<!-- /generated: (?P=name) -->)", re.DOTALL)
#: page -> its text
Texts = Mapping[str, str]


def read(root: Path) -> dict[str, str]:
    """The pages of a checkout; InputError where one is missing."""
    return {page: _read(root / page) for page in PAGES}


def _read(page: Path) -> str:
    try:
        return page.read_text(encoding="utf-8")
    except OSError as problem:
        raise InputError(f"cannot be read: {problem.strerror}", str(page), "run it in a checkout") from problem


def parts_of(texts: Texts) -> dict[str, str]:
    """The generated parts of the pages, name to body; InputError unless each page holds its own once and no other."""
    bodies: dict[str, str] = {}
    for page, names in PAGES.items():
        parts = [(part["name"], part["body"].strip()) for part in _PART.finditer(texts[page])]
        if sorted(name for name, _ in parts) != sorted(names):
            there = ", ".join(name for name, _ in parts) or "none"
            wanted = ", ".join(names)
            raise InputError(f"the generated parts are {there}", page, f"keep the marks of {wanted}, each once")
        bodies |= dict(parts)
    return bodies


def filled(texts: Texts, bodies: Mapping[str, str]) -> dict[str, str]:
    """The pages with their generated parts replaced; all else stays as it is."""
    parts_of(texts)
    return {
        page: _PART.sub(lambda part: f"{part[1]}\n{bodies[part['name']].strip()}\n\n{part[4]}", text)
        for page, text in texts.items()
    }


def problems(root: Path) -> list[str]:
    """What pages and pictures lack: empty parts, and pictures that are absent or too large."""
    texts = read(root)
    empty = [name for name, body in parts_of(texts).items() if not body]
    lacking = [f"the part {name} is empty; `make {ATTACKED.get(name, 'docs')}` fills it" for name in empty]
    for page, text in texts.items():
        for name in sorted(set(re.findall(r'(?:src|srcset)="([^"]+)"', text))):
            file = Path(os.path.normpath((root / page).parent / name))
            if not file.is_file():
                lacking.append(f"{name} is shown but does not exist; `make docs` draws it")
            elif file.stat().st_size > LARGEST_PICTURE:
                lacking.append(f"{name} has {file.stat().st_size} bytes, more than {LARGEST_PICTURE}")
    return lacking
