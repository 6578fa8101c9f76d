"""Whether a folder holds the report of a run already: then nothing need be drawn.

`made.json` beside the page says of what it was made, and the SHA-256 of each of its files. A report is kept where all
of that is as it was: manifest and tables of the run, our code, the libraries that draw, the machine, and every byte.
"""

import json
import os
import re
from collections.abc import Iterable
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any

from phongbench.results import answering
from phongbench.support.atomic_files import write_bytes, write_text, write_whole
from phongbench.support.user_paths import make_folder

PAGE, MADE = "index.html", "made.json"
#: files of a report as its note names them
_FILE = re.compile(r"(?:[a-z]+/)?[A-Za-z0-9_.-]+")
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


def there(run: Any, folder: Path) -> Path | None:
    """The page of the report of this run in this folder, if it is there already, whole and made of the same.

    A folder that is not there yet becomes a copy of the run's own report, if that is. Asked before anything is imported
    that draws, so by the figures that the note names: which there are is said by our code, of which it has the digest.
    """
    if _is_of(run, folder):
        return folder / PAGE
    own = run.path / "report"
    if os.path.lexists(folder) or not _is_of(run, own):
        return None
    make_folder(folder)
    for name in (*_note(own)["files"], MADE):
        write_bytes(folder / name, (own / name).read_bytes(), sync=False)
    return folder / PAGE


def _is_of(run: Any, folder: Path) -> bool:
    figures = _note(folder).get("figures")
    of = origin(run, figures) if isinstance(figures, list) else None
    return of is not None and is_current(folder, of)


def is_current(folder: Path, origin: str) -> bool:
    """Whether the report in this folder is what `remember` was told of, made of the same, every file whole."""
    made = _note(folder)
    try:
        files = made["files"].items()
        whole = (_FILE.fullmatch(name) and _digest(folder / name) == told for name, told in files)
        return made["of"] == origin and bool(files) and all(whole)
    except (OSError, ValueError, LookupError, TypeError, AttributeError):
        return False


def _note(folder: Path) -> dict[str, Any]:
    """What `remember` wrote; nothing where that cannot be read."""
    try:
        made = json.loads((folder / MADE).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return made if isinstance(made, dict) else {}


def remember(folder: Path, origin: str, figures: Iterable[str], names: Iterable[str]) -> None:
    """Write down of what the report in this folder was made, with which figures, whose files these are."""
    made = {"of": origin, "figures": list(figures), "files": {name: _digest(folder / name) for name in names}}
    write_whole(folder / MADE, lambda path: write_text(path, json.dumps(made, indent=1, sort_keys=True) + "\n"))


def _digest(path: Path) -> str:
    return sha256(path.read_bytes()).hexdigest()
