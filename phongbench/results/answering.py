"""Which run answers, and what it answered before: kept in its folder, so that who asks again waits for no table.

RUN/answers holds a file for each question. Its first line is the SHA-256 of what the answer was made of (manifest and
tables of the run, our code and the costs that ship with it, releases, the machine, targets that were added) and of the
answer itself, which is the rest. One that was made of anything else, or is not whole, is made again. Nothing depends on
these files: they may be deleted, and where none can be written every answer is made anew.
"""

import gc
import json
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from hashlib import sha256
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

from phongbench.errors import PhongbenchError
from phongbench.formulas.user_files import GROUP
from phongbench.results.checkpoints import sha256 as sha256_of
from phongbench.results.provenance import fingerprint_machine, flags, versions
from phongbench.results.runs import ADDED, ANSWERS, DEFAULT_ROOT, Run, find, stored
from phongbench.support.atomic_files import write_bytes

#: so many are kept, the newest
MOST = 64
_NAME = re.compile(r"[0-9a-f]{32}\.json")
_PACKAGE = Path(__file__).parents[1]


def run_for(name: str | None, root: Path = DEFAULT_ROOT) -> Run | None:
    """The run of this name; without one, the newest whole run with times; None where there is none.

    name  an id under `root`, `latest` or a folder; InputError where there is no such run
    """
    if name is not None:
        return find(name, root)
    whole = (run for run in reversed(stored(root)) if run.complete)
    return next((run for run in whole if run.manifest["files"].get("timing.parquet", {}).get("rows", 0)), None)


def kept(run: Any, root: Path, make: Callable[..., Any], **question: Any) -> Any:
    """The answer make(run, root=root, **question), as JSON holds it: lists for tuples. What it gave before, if it is
    the same still.

    run       the Run that answers; of anything else, as of None, nothing is kept
    root      the folder of the runs, with the targets that were added
    make      named after what it answers; may raise, and is then asked again the next time
    question  as JSON can hold it
    """
    with _uncollected():
        return json.loads(_answer(run, root, make, question))


@contextmanager
def _uncollected() -> Iterator[None]:
    """Let no garbage be looked for meanwhile: an answer imports much and leaves little, and takes a twentieth less."""
    if not gc.isenabled():
        yield
        return
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


def _answer(run: Any, root: Path, make: Callable[..., Any], question: Mapping[str, Any]) -> str:
    """The answer as text, see `kept`."""
    of = origin(run, sorted((root / ADDED).glob("*.json")))
    if of is None:
        return _text(make(run, root=root, **question))
    asked = json.dumps([make.__module__, make.__name__, str(run.path), question], sort_keys=True)
    file = run.path / ANSWERS / f"{sha256(asked.encode()).hexdigest()[:32]}.json"
    text = _read(file, of)
    if text is None:
        text = _text(make(run, root=root, **question))
        with suppress(PhongbenchError, OSError):  # a folder that cannot be written to answers as well
            _write(file, of, text)
    return text


def origin(run: Any, beside: Iterable[Path] = ()) -> str | None:
    """Digest of what decides every answer of a run; None where that may be more: plug-ins, files that are missing, or
    what is no stored run.

    beside  other files that do
    """
    if not isinstance(run, Run) or entry_points(group=GROUP):
        return None
    try:
        digests, added = run.digests(), [(path.name, sha256_of(path)) for path in beside]
    except OSError:
        return None
    if digests.keys() != run.manifest["files"].keys():
        return None
    held = [*digests.items(), *added]
    program = (digest_of_folder(_PACKAGE), str(versions()), str(flags()), fingerprint_machine())
    return sha256(json.dumps([dict(run.manifest), held, program], sort_keys=True).encode()).hexdigest()


def digest_of_folder(folder: Path) -> str:
    """SHA-256 of names and bytes of all files below a folder, but for what Python compiled of them."""
    total = sha256()
    for path in sorted(_files(folder)):
        content = Path(path).read_bytes()
        total.update(f"{os.path.relpath(path, folder)}\0{len(content)}\0".encode() + content)
    return total.hexdigest()


def _files(folder: Path) -> Iterator[str]:
    """The paths of all files, in no order; `Path.rglob` takes several times as long."""
    for place, folders, names in os.walk(folder):
        folders[:] = [name for name in folders if name != "__pycache__"]
        yield from (os.path.join(place, name) for name in names)  # noqa: PTH118 - as above


def _text(answer: Any) -> str:
    """The answer as JSON; of NumPy's numbers their values."""
    return json.dumps(answer, default=lambda value: value.item())


def _signed(of: str, text: str) -> str:
    return sha256(f"{of}\n{text}".encode()).hexdigest()


def _read(file: Path, of: str) -> str | None:
    """The answer in a file; None where there is none, or not of this origin, or not as it was written."""
    try:
        signature, _, text = file.read_text(encoding="utf-8").partition("\n")
    except (OSError, ValueError):
        return None
    return text if signature == _signed(of, text) else None


def _write(file: Path, of: str, text: str) -> None:
    """Keep an answer, and no more than MOST: the oldest are deleted. A link in place of the folder is not followed."""
    if file.parent.is_symlink():
        return
    write_bytes(file, f"{_signed(of, text)}\n{text}".encode(), sync=False)
    known = [path for path in file.parent.iterdir() if _NAME.fullmatch(path.name)]
    for old in sorted(known, key=lambda path: (path.stat().st_mtime_ns, path.name))[:-MOST]:
        old.unlink(missing_ok=True)
