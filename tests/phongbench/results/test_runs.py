"""A run's folder: whole files, honest manifests, found by name, refused when it is not what it says."""

import json
import multiprocessing

import pandas as pd
import pytest

from phongbench.errors import CorruptRunError, InputError, LockedError, StorageError
from phongbench.inputs.plan import preset
from phongbench.results import runs, schema
from phongbench.results.frames import strongest
from phongbench.results.run_lock import locked
from phongbench.support import atomic_files


@pytest.fixture
def run(tmp_path):
    """A tiny stored run."""
    path = tmp_path / "runs" / "20260101-000000-abcdef01"
    path.mkdir(parents=True)
    frame = pd.DataFrame({c: ["x", "y", "z"] for c in schema.ACCURACY.names}).assign(device=["cpu", "cpu", "gpu"])
    manifest = {
        "schema": 1,
        "run": path.name,
        "state": "complete",
        "plan": preset("quick").as_dict(),
        "seed": 1,
        "code": "c",
        "provenance": {},
        "files": {"accuracy.parquet": runs.write_table(path, "accuracy", frame)},
    }
    runs.write_manifest(path, manifest)
    return runs.load(path)


def test_what_is_written_is_read_back(run):
    assert run.complete
    assert run.plan == preset("quick")
    assert list(run.accuracy["alpha"]) == ["x", "y"]  # of this machine's processor
    assert list(run.device_accuracy["alpha"]) == ["z"]
    assert list(run.accuracy.columns) == list(run.device_accuracy.columns) == schema.ACCURACY.names
    assert run.timing.empty
    assert list(run.timing.columns) == schema.TIMING.names
    assert runs.verify(run) == []


def test_verify_finds_a_flipped_byte(run):
    path = run.path / "accuracy.parquet"
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    assert "bytes have changed" in runs.verify(run)[0]


def test_verify_finds_a_table_of_another_length_than_the_manifest_says(run):
    told = json.loads((run.path / runs.MANIFEST).read_text())
    told["files"]["accuracy.parquet"]["rows"] += 1
    runs.write_manifest(run.path, told)
    assert runs.verify(runs.load(run.path)) == ["accuracy.parquet: does not have 4 rows"]


def test_a_run_is_looked_at_once_for_an_answer_and_anew_by_verify(run):
    path = run.path / "accuracy.parquet"
    assert runs.intact(run) is run
    path.write_bytes(path.read_bytes()[:-1])
    assert runs.intact(run) is run
    assert runs.verify(run)
    with pytest.raises(CorruptRunError, match="bytes instead of"):
        runs.intact(runs.load(run.path))


def test_verify_finds_a_missing_and_a_short_file(run):
    path = run.path / "accuracy.parquet"
    path.write_bytes(path.read_bytes()[:-1])
    assert "bytes instead of" in runs.verify(run)[0]
    path.unlink()
    assert "is missing" in runs.verify(run)[0]


def test_a_partial_run_says_so(run):
    runs.write_manifest(run.path, dict(run.manifest) | {"state": "partial"})
    assert "partial" in runs.verify(runs.load(run.path))[0]


def test_runs_are_found_by_path_by_id_and_as_latest(run):
    root = run.path.parent
    assert runs.find(str(run.path), root).id == run.id
    assert runs.find(run.id, root).id == run.id
    assert runs.find("latest", root).id == run.id
    with pytest.raises(InputError, match="no run 'nope'"):
        runs.find("nope", root)
    with pytest.raises(InputError, match="no run yet"):
        runs.find("latest", root / "empty")


def test_of_many_runs_the_newest_five_are_named(run):
    names = [f"20260101-00000{second}-abcdef01" for second in range(7)]
    for name in names[1:]:
        run.path.with_name(name).mkdir()
        runs.write_manifest(run.path.with_name(name), dict(run.manifest) | {"run": name})
    with pytest.raises(InputError) as error:
        runs.find("nope", run.path.parent)
    assert [name in str(error.value.fix) for name in names] == 2 * [False] + 5 * [True]


@pytest.mark.parametrize("text", ["", "{", "[]", '{"schema": 1}', "{}", "\x00"])
def test_a_broken_manifest_is_refused(run, text):
    (run.path / "manifest.json").write_text(text)
    with pytest.raises(CorruptRunError):
        runs.load(run.path)


@pytest.mark.parametrize("text", [None, '{"name": "of another program"}'])
def test_a_folder_without_a_manifest_of_ours_is_no_run(run, text):
    (run.path / "manifest.json").unlink()
    if text:
        (run.path / "manifest.json").write_text(text)
    with pytest.raises(InputError, match="is not a run"):
        runs.load(run.path)


SHARD = {"index": 1, "count": 2, "arithmetic": {"numba": "1"}}
TABLE = {"sha256": "0", "rows": 0, "bytes": 0}
WRONG = [
    *[("run", value) for value in (1, None)],
    *[("state", value) for value in ("done", True)],
    *[("plan", value) for value in (None, [], {"colour": "red"})],
    *[("plan", {name: value}) for name, value in (("samples", 1.5), ("samples", "1"), ("timing", 1), ("alphas", 5.0))],
    *[("plan", {name: value}) for name, value in (("alphas", ["5"]), ("timing_budget", True), ("timing_budget", "1"))],
    *[("seed", value) for value in (-1, True, 1.0, "1")],
    ("code", 1),
    ("provenance", []),
    *[("files", value) for value in ([], {"../accuracy.parquet": TABLE}, {"accuracy.csv": TABLE}, {"a.parquet": 1})],
    *[("files", {"accuracy.parquet": TABLE | {name: None}}) for name in TABLE],
    *[(name, value) for name in ("with", "violations") for value in ("text", [1])],
    *[(name, []) for name in ("failures", "probes", "cluster", "seconds")],
    *[
        ("shard", SHARD | change)
        for change in ({"index": 0}, {"index": 3}, {"count": 2.0}, {"arithmetic": {"numba": 1}})
    ],
    *[("shard", SHARD | change) for change in ({"failures": []}, {"parts": {"a": 1}}, {"parts": ["a"]})],
    *[("cluster", {"workers": value}) for value in (-1, True, "2")],
    *[("merged", value) for value in ({}, [1])],
    *[("seconds", {"sweep": value}) for value in ("1", True, None)],
]
RIGHT = [
    ("plan", {"timing_budget": 1}),
    ("files", {"accuracy.parquet": TABLE}),
    ("with", ["a.py"]),
    ("violations", []),
    ("shard", SHARD | {"index": 2, "failures": {"a": "b"}, "parts": {"a": "0"}}),
    ("cluster", {"workers": 0}),
    ("merged", [{}]),
    ("seconds", {"sweep": 1, "timing": 0.5}),
]


@pytest.mark.parametrize(("key", "value"), WRONG, ids=str)
def test_a_manifest_with_a_value_of_another_kind_is_refused_by_its_key(run, key, value):
    runs.write_manifest(run.path, dict(run.manifest) | {key: value})
    with pytest.raises(CorruptRunError, match=f"holds no {key} that"):
        runs.load(run.path)


@pytest.mark.parametrize(("key", "value"), RIGHT, ids=str)
def test_a_manifest_with_all_that_it_may_hold_is_read(run, key, value):
    runs.write_manifest(run.path, dict(run.manifest) | {key: value})
    assert runs.load(run.path).manifest[key] == value


def test_another_schema_is_refused(run):
    runs.write_manifest(run.path, dict(run.manifest) | {"schema": 99})
    with pytest.raises(CorruptRunError, match="schema 99"):
        runs.load(run.path)


def test_a_table_that_is_no_parquet_is_refused(run):
    (run.path / "accuracy.parquet").write_bytes(b"PAR1 nonsense")
    with pytest.raises(CorruptRunError, match="cannot be read"):
        _ = runs.load(run.path).accuracy


def test_columns_that_older_runs_lack_are_known_and_no_others():
    lacking = {name: [c.name for c in table.columns if c.optional] for name, table in schema.TABLES.items()}
    assert {name: columns for name, columns in lacking.items() if columns} == {
        "accuracy": ["device"],
        "timing": ["repeats", "compile_ms", "lit", "processes"],
        "costs": ["reads"],
    }


@pytest.mark.parametrize(("name", "lacking", "said"), [("costs", "reads", 0), ("accuracy", "device", "cpu")])
def test_of_tables_of_older_runs_it_is_known_what_went_without_saying(run, name, lacking, said):
    frame = pd.DataFrame({c: ["x", "y"] for c in schema.TABLES[name].names if c != lacking})
    files = {f"{name}.parquet": runs.write_table(run.path, name, frame)}
    runs.write_manifest(run.path, {**run.manifest, "files": files})
    assert runs.load(run.path).read(name)[lacking].tolist() == [said, said]


def test_a_corrupt_run_does_not_hide_the_others(run):
    other = run.path.with_name("20260101-000001-abcdef01")
    other.mkdir()
    (other / "manifest.json").write_text("{")
    assert [r.id for r in runs.stored(run.path.parent)] == [run.id]


def test_a_failing_write_leaves_the_old_file_and_no_other(tmp_path):
    target = tmp_path / "a.txt"
    target.write_text("old")

    def fail(path):
        path.write_text("half")
        raise OSError(28, "No space left on device")

    with pytest.raises(StorageError, match="free some space"):
        atomic_files.write_whole(target, fail)
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def _hold(path, held, release):
    with locked(path):
        held.set()
        release.wait(20)


def test_a_folder_is_held_by_one_process_at_a_time(tmp_path):
    context = multiprocessing.get_context("spawn")
    held, release = context.Event(), context.Event()
    process = context.Process(target=_hold, args=(tmp_path / "run", held, release))
    process.start()
    try:
        assert held.wait(20)
        with pytest.raises(LockedError, match="another phongbench run"), locked(tmp_path / "run"):
            pass
    finally:
        release.set()
        process.join(20)
    with locked(tmp_path / "run"):
        pass


def test_clear_removes_only_what_a_run_wrote(run):
    keep = run.path / "notes.txt"
    keep.write_text("mine")
    runs.clear(run.path)
    assert list(run.path.iterdir()) == [keep]


def test_run_ids_match_their_pattern():
    assert runs.RUN_ID.match(runs.new_run_id(preset("quick")))


def test_manifests_are_strict_json(run):
    with pytest.raises(ValueError, match="not JSON compliant"):
        runs.write_manifest(run.path, {"x": float("nan")})
    assert json.loads((run.path / "manifest.json").read_text())["run"] == run.id


def test_the_strongest_coverage_speaks_for_a_cell():
    rows = pd.DataFrame(
        {"approximation": ["lyon"] * 4, "alpha": [10.0, 10.0, 10.0, 20.0], "max_abs": [0.3, 0.2, 0.1, 0.4]}
        | {"coverage": ["exhaustive", "sampled", "searched", "sampled"]}
    )
    assert list(strongest(rows)["max_abs"]) == [0.3, 0.4]
    assert list(strongest(rows.iloc[1:])["max_abs"]) == [0.1, 0.4]
    pd.testing.assert_frame_equal(strongest(rows[["alpha"]]), rows[["alpha"]])
