"""The one on-disk form of a run: a folder with a manifest and Parquet tables; created, loaded and verified here.

Files appear whole or not at all. While a study runs, what is finished is kept apart (checkpoints.py); a complete run
is its tables alone. pandas is imported where a table is: names and folders of runs can be had without.
"""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from phongbench.errors import CorruptRunError, InputError
from phongbench.inputs.plan import Plan
from phongbench.results.checkpoints import PARTS, sha256
from phongbench.results.faults import digests_of, faults
from phongbench.results.frames import read_frame, with_raw
from phongbench.results.manifests import REMEDY, read_manifest
from phongbench.results.records import Records
from phongbench.results.schema import CPU, RAW, TABLES, UNSAID
from phongbench.support.atomic_files import write_text, write_whole
from phongbench.support.user_paths import is_file, is_folder, reading, writing

if TYPE_CHECKING:
    import pandas as pd
SCHEMA = 1
#: what to do about a partial run
FINISH = "finish it: phongbench run --resume --out FOLDER, with this folder"
RUN_ID = re.compile(r"^[a-z0-9][a-z0-9-]{7,63}$")
DEFAULT_ROOT = Path("phongbench-runs")
MANIFEST = "manifest.json"
#: folders of answers that were given before, in that of a run, and of added targets, in that of the runs
ANSWERS, ADDED = "answers", "targets"
#: everything a run writes into its folder
RUN_CONTENT = (PARTS, "report", ANSWERS, MANIFEST, *(f"{name}.parquet" for name in TABLES))


def _table(name: str) -> cached_property[pd.DataFrame]:
    return cached_property(lambda run: run.read(name))


@dataclass(frozen=True)
class Run:
    """A stored run. Its tables, as results.schema describes them, are read at their first use.

    What the plan did not ask for has an empty table. `records` reads a table without pandas, for answers.
    """

    path: Path
    manifest: Mapping[str, Any]

    @property
    def id(self) -> str:
        """The run's identifier."""
        return str(self.manifest["run"])

    @property
    def plan(self) -> Plan:
        """The plan it measured."""
        return Plan.from_dict(self.manifest["plan"])

    @property
    def complete(self) -> bool:
        """False if it was interrupted and can be resumed."""
        return bool(self.manifest["state"] == "complete")

    @property
    def shard(self) -> str | None:
        """Which shard of how many, as `2/8`; None for a whole run."""
        told = self.manifest.get("shard")
        return f"{told['index']}/{told['count']}" if told else None

    @cached_property
    def problems(self) -> list[str]:
        """What was wrong with its files when that was first asked, see `verify`, or when `digests` last was."""
        return _problems(self, self._hashed)

    def digests(self) -> dict[str, str]:
        """SHA-256 of its files now; none of a file that is not there."""
        self._hashed.clear()
        self._hashed.update(digests_of(self.path, self.manifest["files"]))
        return dict(self._hashed)

    @cached_property
    def _hashed(self) -> dict[str, str]:
        """The digests of its files that are known."""
        return {}

    @cached_property
    def accuracy(self) -> pd.DataFrame:
        """The errors that this machine's processor makes."""
        return _of_processor(self._errors)

    @cached_property
    def device_accuracy(self) -> pd.DataFrame:
        """The errors that other devices make, of the code that is written for them."""
        return self._errors[self._errors["device"] != CPU].reset_index(drop=True)

    @cached_property
    def compact_accuracy(self) -> pd.DataFrame:
        """The same as `accuracy`, its text as categories: half the memory, for who looks through all of it."""
        return _of_processor(self.read("accuracy", compact=True))

    _errors = _table("accuracy")
    timing = _table("timing")
    worst = _table("worst")
    meshes = _table("meshes")
    behaviour = _table("behaviour")
    smoothness = _table("smoothness")
    scenes = _table("scenes")
    skips = _table("skips")
    scene_times = _table("scene_times")
    far = _table("far")
    inverse = _table("inverse")
    emitted = _table("emitted")
    incidence = _table("incidence")
    incidence_times = _table("incidence_times")
    moments = _table("moments")
    cuts = _table("cuts")
    costs = _table("costs")

    def read(self, name: str, *, compact: bool = False) -> pd.DataFrame:
        """A table, read anew, or compact, see `frames`. CorruptRunError if it cannot be read or lacks columns."""
        path = self.path / f"{name}.parquet"
        if path.name not in self.manifest["files"]:
            return TABLES[name].frame()
        frame = read_frame(path, compact=compact)
        if RAW.keys() <= set(TABLES[name].names):
            frame = with_raw(frame)
        unsaid = {column: value for column, value in UNSAID.get(name, {}).items() if column not in frame}
        frame = frame.assign(**unsaid) if unsaid else frame
        _require(path, name, frame.columns)
        return frame

    def records(self, name: str) -> Records:
        """The rows of a table, as its property has them; `accuracy` of this machine's processor. Raises as `read`."""
        if name not in self._records:
            path = self.path / f"{name}.parquet"
            if path.name not in self.manifest["files"]:
                return Records.none(name)
            usual = {column: value for column, value in RAW.items() if column in TABLES[name].names}
            rows = Records.read(path, name, {**usual, **UNSAID.get(name, {})})
            _require(path, name, rows.known)
            self._records[name] = rows.at(device=CPU) if name == "accuracy" else rows
        return self._records[name]

    @cached_property
    def _records(self) -> dict[str, Records]:
        """The tables that `records` was asked for."""
        return {}


def _of_processor(errors: pd.DataFrame) -> pd.DataFrame:
    mine = errors["device"] == CPU
    return errors if mine.all() else errors[mine].reset_index(drop=True)


def _require(path: Path, name: str, columns: Iterable[str]) -> None:
    """CorruptRunError for a table that lacks columns."""
    missing = [column for column in TABLES[name].required if column not in columns]
    if missing:
        raise CorruptRunError(f"lacks the columns {', '.join(missing)}", str(path), REMEDY)


def new_run_id(plan: Plan) -> str:
    """YYYYMMDD-HHMMSS-<8 hex of the plan>, in UTC."""
    return f"{datetime.now(UTC):%Y%m%d-%H%M%S}-{plan.digest}"


def load(path: Path) -> Run:
    """The run in this folder. InputError if there is none, CorruptRunError if its manifest is not as it was written."""
    return Run(path, read_manifest(path / MANIFEST, SCHEMA))


def find(name: str, root: Path = DEFAULT_ROOT) -> Run:
    """A run by path, by id under `root`, or the newest complete one for `latest`. InputError tells where it looked."""
    if name == "latest":
        runs = stored(root)
        complete = [run for run in runs if run.complete]
        if not runs:
            raise InputError("there is no run yet", str(root), "make one: phongbench run")
        if not complete:
            fix = f"name it: {runs[-1].id}; or finish it: phongbench run --resume --out {runs[-1].path}"
            raise InputError("no run here is complete; the newest is partial", str(root), fix)
        return complete[-1]
    if RUN_ID.match(name) and is_file(root / name / MANIFEST):
        return load(root / name)
    if name and is_folder(name):
        return load(Path(name))
    known = ", ".join(run.id for run in stored(root)[-5:]) or "none"
    raise InputError(f"no run {name!r}", str(root), f"give a folder, `latest`, or an id; the newest here: {known}")


def stored(root: Path = DEFAULT_ROOT) -> list[Run]:
    """The readable runs under a folder, oldest first; what is not a run is passed over."""
    with reading(root, "folder of the runs", "give a folder that can be read"):
        folders = sorted(root.iterdir()) if is_folder(root) else []
    runs = []
    for path in folders:
        if is_file(path / MANIFEST) and RUN_ID.match(path.name):
            with suppress(CorruptRunError, InputError):
                runs.append(load(path))
    return runs


def verify(run: Run) -> list[str]:
    """What is wrong with a stored run, as sentences; empty if every byte is as it was written."""
    return _problems(run, {})


def _problems(run: Run, digests: Mapping[str, str]) -> list[str]:
    """The same, by digests of files that are known already."""
    problems = faults(run.path, run.manifest["files"], digests)
    if not run.complete:
        whole = "it was interrupted and can be resumed"
        problems.append("the run is partial: " + (f"it is shard {run.shard}" if run.shard else whole))
    return problems


def unfinished(run: Run) -> str | None:
    """That a run is partial and what it lacks, in a sentence without a full stop; None for a complete one."""
    if run.complete:
        return None
    if run.shard:
        interrupted = "" if measured_shard(run) else ", and was interrupted"
        return f"the run is partial: it is shard {run.shard} of a sweep{interrupted}"
    files, plan = run.manifest["files"], run.plan
    stages = {
        "errors": "accuracy.parquet" in files,
        "probes": "probes" in run.manifest or not plan.probes,
        "timing": "timing.parquet" in files or not plan.timing,
    }
    lacking = [stage for stage, done in stages.items() if not done]
    missing = f" and lacks its {', '.join(lacking)}" if lacking else ""
    return f"the run is partial: it was interrupted{missing}"


def remedy(run: Run) -> str:
    """What to do about a partial run."""
    joined = "join it with the other shards: phongbench merge FOLDER .. --out RUN"
    return joined if measured_shard(run) else FINISH


def measured_shard(run: Run) -> bool:
    """True of a shard that has nothing left to measure: it stays partial, and is joined with the others."""
    return "parts" in run.manifest.get("shard", {})


def require_rows(run: Run) -> Run:
    """The run, if it has accuracy rows; InputError if it was interrupted before, or could measure none of its cells."""
    if not len(run.records("accuracy")):
        what = unfinished(run) or "the run has no accuracy rows: none of its cells could be measured"
        raise InputError(what, str(run.path), remedy(run) if not run.complete else "run it again with other formulas")
    return run


def intact(run: Run) -> Run:
    """The run, for building on it: InputError if it is partial, CorruptRunError if a byte changed; looked at once."""
    if lacking := unfinished(run):
        raise InputError(lacking, str(run.path), remedy(run))
    if problems := run.problems:
        raise CorruptRunError("; ".join(problems), str(run.path), REMEDY)
    return run


def write_manifest(path: Path, manifest: Mapping[str, Any]) -> None:
    """Write manifest.json, sorted and readable."""
    text = json.dumps(manifest, indent=2, sort_keys=True, allow_nan=False) + "\n"
    write_whole(path / MANIFEST, lambda p: write_text(p, text))


def write_table(path: Path, name: str, frame: pd.DataFrame) -> dict[str, Any]:
    """Write a table; the manifest's entry for it: SHA-256, rows, bytes."""
    file = path / f"{name}.parquet"
    write_whole(file, lambda p: frame.to_parquet(p, engine="pyarrow", compression="zstd", index=False))
    return {"sha256": sha256(file), "rows": len(frame), "bytes": file.stat().st_size}


def clear(path: Path, names: Iterable[str] = RUN_CONTENT) -> None:
    """Remove what a run wrote into its folder, and nothing else."""
    with writing(path):
        for name in names:
            target = path / name
            if target.is_dir():
                shutil.rmtree(target)
            else:
                target.unlink(missing_ok=True)
