"""Whether a folder holds the report of a run already: then nothing need be drawn.

`made.json` beside the page says of what it was made, and the SHA-256 of each of its files. A report is kept where all
of that is as it was: manifest and tables of the run, our code, the libraries that draw, the machine, and every byte.
"""

import json
from collections.abc import Iterable
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any

from phongbench.results import answering
from phongbench.support.atomic_files import write_text, write_whole

MADE = "made.json"
_PACKAGE = Path(__file__).parent
#: besides those that decide a run's results
_LIBRARIES = ("matplotlib", "jinja2")


def origin(run: Any, figures: Iterable[str]) -> str | None:
    """Digest of what decides the bytes of a report of these figures; None where that may be more: plug-ins, say."""
    answers = answering.origin(run)
    if answers is None:
        return None
    code = (answering.digest_of_folder(_PACKAGE), *map(version, _LIBRARIES))
    return sha256(json.dumps([answers, code, *figures]).encode()).hexdigest()


def is_current(folder: Path, origin: str) -> bool:
    """Whether the report in this folder is what `remember` was told of, made of the same, every file whole."""
    try:
        made = json.loads((folder / MADE).read_text(encoding="utf-8"))
        files = made["files"].items()
        return made["of"] == origin and bool(files) and all(_digest(folder / name) == told for name, told in files)
    except (OSError, ValueError, LookupError, TypeError, AttributeError):
        return False


def remember(folder: Path, origin: str, names: Iterable[str]) -> None:
    """Write down of what the report in this folder was made, whose files these are."""
    made = {"of": origin, "files": {name: _digest(folder / name) for name in names}}
    write_whole(folder / MADE, lambda path: write_text(path, json.dumps(made, indent=1, sort_keys=True) + "\n"))


def _digest(path: Path) -> str:
    return sha256(path.read_bytes()).hexdigest()
