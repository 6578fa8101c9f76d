"""Changes are real, single and repeatable; tests that look notice one, and what none looks at survives."""

import ast
import json
import os
import subprocess
import sys
import tomllib
from collections import Counter
from pathlib import Path

import pytest
from mutating.__main__ import JUDGED
from mutating.changes import ROOMS, Change, drawn, of_source
from mutating.choice import Traces, Uses
from mutating.tables import Seen

ROOT = Path(__file__).resolve().parents[2]
MODULE = "phongbench/support/small.py"
SOURCE = """LIMIT = 3
def small(x: "int | None") -> bool:
    if x is None or x + 1 < LIMIT:
        return True
    return False
"""
LOOKS = "from phongbench.support.small import small\ndef test_it():\n    assert small(1)\n"
#: traces a checkout, tries every change, and tells what came of them and whether the copy is whole again
TRIES = f"""
import json, sys
from pathlib import Path
from mutating.changes import drawn
from mutating.trials import Bench
checkout, state = map(Path, sys.argv[1:])
bench = Bench(checkout, state, lambda text: None)
changes = drawn(bench.copy, ["support"], 1)
found = bench.results(changes, again=False)
for change in changes:
    bench.keep(found, change.name, bench.tried(change))
tests = bench.traces(("phongbench/support",)).tests
whole = (bench.copy / "{MODULE}").read_bytes() == (checkout / "{MODULE}").read_bytes()
later = Bench(checkout, state, lambda text: None).results(changes, again=True)
print(json.dumps([[[test.name, test.lines] for test in tests], list(found.values()), list(later.values()), whole]))
"""


def changes(source: str = SOURCE) -> list[Change]:
    return list(of_source("support", MODULE, source.encode()))


def named(after: str) -> Change:
    return next(one for one in changes() if one.after == after)


def test_a_source_changes_in_one_place_each_time() -> None:
    seen = Counter((one.kind, one.before, one.after) for one in changes())
    assert seen == Counter(
        [
            ("constant", "3", "4"),
            ("condition", "x is None or x + 1 < LIMIT", "not (x is None or x + 1 < LIMIT)"),
            ("operator", "x is None or x + 1 < LIMIT", "x is None and x + 1 < LIMIT"),
            ("comparison", "x is None", "x is not None"),
            ("comparison", "x + 1 < LIMIT", "x + 1 <= LIMIT"),
            ("operator", "x + 1", "x - 1"),
            ("constant", "1", "2"),
            ("constant", "True", "False"),
            ("constant", "False", "True"),
        ]
    )
    assert named("x - 1").applied(SOURCE.encode()).decode() == SOURCE.replace("x + 1", "(x - 1)")


@pytest.mark.parametrize("source", ['a = f"{1}"', 'a = "text" + "more"', "if TYPE_CHECKING:\n    a = 1", "a: 'x' = b"])
def test_words_and_what_checkers_read_are_left_alone(source: str) -> None:
    assert changes(source) == []


def test_lines_keep_their_numbers_and_letters_their_places() -> None:
    source = "é = ('ü', 1 +\n     2)\nlast = 0\n"
    sum_ = next(one for one in changes(source) if one.kind == "operator")
    changed = sum_.applied(source.encode()).decode()
    assert changed.splitlines()[-1] == "last = 0"
    assert len(changed.splitlines()) == 3
    assert (sum_.line, sum_.lines) == (1, (1, 2))


@pytest.fixture(scope="module")
def product() -> list[Change]:
    """Every change of the product."""
    return drawn(ROOT, list(ROOMS), 1)


def test_every_change_of_the_product_parses_and_has_a_name_of_its_own(product: list[Change]) -> None:
    assert len(product) > 3000
    assert {one.room for one in product} == set(ROOMS)
    for one in product[::100]:
        source = (ROOT / one.file).read_bytes()
        assert ast.dump(ast.parse(one.applied(source))) != ast.dump(ast.parse(source)), one
    repeated = [name for name, times in Counter(one.name for one in product).items() if times > 1]
    assert len(repeated) < len(product) / 50  # lines that a file has twice


def test_equal_seeds_change_the_same() -> None:
    first, again, other = (drawn(ROOT, ["results"], seed) for seed in (1, 1, 2))
    assert first == again != other
    assert {one.name for one in first} == {one.name for one in other}


def test_what_is_compiled_is_left_alone(product: list[Change]) -> None:
    assert not [one for one in product if one.file == "phongbench/inputs/length_errors.py"]


def test_what_a_test_looks_at_is_caught_and_the_rest_survives(tmp_path: Path) -> None:
    packages = dict.fromkeys(("phongbench/__init__.py", "phongbench/support/__init__.py", "pyproject.toml"), "")
    for name, text in (packages | {MODULE: SOURCE, "tests/phongbench/support/test_small.py": LOOKS}).items():
        (path := tmp_path / "checkout" / name).parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    # in a process of its own, which has not loaded the product
    command = [sys.executable, "-c", TRIES, str(tmp_path / "checkout"), str(tmp_path / "state")]
    surroundings = os.environ | {"PYTHONPATH": str(ROOT / "tests" / "mutate")}
    ended = subprocess.run(command, env=surroundings, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
    tests, found, later, whole = json.loads(ended.stdout)
    assert tests == [["tests/phongbench/support/test_small.py::test_it", {MODULE: [3, 4]}]]
    ends = {one["after"]: (one["end"], one["note"] != "") for one in found}
    assert ends == {
        "4": ("survived", False),
        "not (x is None or x + 1 < LIMIT)": ("caught", True),
        "x is None and x + 1 < LIMIT": ("caught", True),
        "x is not None": ("survived", False),
        "x + 1 <= LIMIT": ("survived", False),
        "x - 1": ("survived", False),
        "2": ("caught", True),
        "False": ("caught", True),
        "True": ("survived", False),  # no test runs `return False`, but those named like its module are asked
    }
    assert {one["tests"] for one in found} == {1}  # once, though it is of its module and of its room
    assert {one["end"] for one in later} == {"caught"}
    assert len(later) == 4
    assert whole


USED = """from phongbench.support.small import LIMIT
WIDTHS = {"narrow": LIMIT}
def wide(name):
    return WIDTHS[name]
def other():
    return 0
"""


@pytest.fixture
def uses(tmp_path: Path) -> Uses:
    """A product of two modules, one of which makes something of the other's constant."""
    for name, text in ((MODULE, SOURCE), ("phongbench/support/used.py", USED)):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    return Uses(tmp_path)


def traces(*tests: tuple[str, float, dict[str, list[int]]], needs: tuple[str, ...] = ()) -> Traces:
    """Of tests: name, seconds, lines; they need `tests::dear`, which takes 30 s and runs `x + 1 < LIMIT`."""
    dear = {"fixture": "tests::dear", "seconds": 30.0, "lines": {MODULE: [3]}, "needs": []}
    told = [{"test": name, "seconds": seconds, "lines": lines, "needs": needs} for name, seconds, lines in tests]
    return Traces.of([dear, *told])


def test_tests_are_those_that_meet_the_statement_the_likeliest_first(uses: Uses) -> None:
    known = traces(
        ("tests/a/test_slow.py::test_it", 40.0, {MODULE: [3]}),
        ("tests/a/test_quick.py::test_it", 1.0, {MODULE: [3]}),
        ("tests/a/test_small.py::test_it", 2.0, {MODULE: [3]}),
        ("tests/a/test_elsewhere.py::test_it", 0.1, {MODULE: [4, 5]}),
    )
    first, second = "tests/a/test_small.py::test_it", "tests/a/test_quick.py::test_it"
    assert known.chosen(named("x - 1"), uses, seconds=40.0) == [first, second]
    assert known.chosen(named("x - 1"), uses, seconds=40.0, asked={first}) == [second]
    assert known.chosen(named("x - 1"), uses, seconds=0.0) == [first]
    assert traces().chosen(named("x - 1"), uses, seconds=40.0) == []


def test_a_test_meets_what_its_fixtures_run_and_pays_for_them_once(uses: Uses) -> None:
    known = traces(("a.py::one", 1.0, {}), ("a.py::two", 2.0, {}), needs=("tests::dear", "tests::unknown"))
    assert known.chosen(named("x - 1"), uses, seconds=33.0) == ["a.py::one", "a.py::two"]
    assert known.chosen(named("x - 1"), uses, seconds=32.0) == ["a.py::one"]
    assert known.chosen(named("x - 1"), uses, seconds=3.0, free={"tests::dear"}) == ["a.py::one", "a.py::two"]


def test_a_constant_is_met_where_it_is_used_and_where_what_is_made_of_it_is(uses: Uses) -> None:
    known = traces(
        ("a.py::test_small", 1.0, {MODULE: [3]}),
        ("a.py::test_wide", 2.0, {"phongbench/support/used.py": [4]}),
        ("a.py::test_other", 1.0, {"phongbench/support/used.py": [6]}),
        ("b.py::test_names_it", 1.0, {}),
    )
    constant = named("4")
    assert constant.names == ("LIMIT",)
    assert known.chosen(constant, uses, seconds=9.0) == ["a.py::test_small", "a.py::test_wide"]
    assert known.chosen(constant, uses, seconds=9.0, named={"b.py"})[-1] == "b.py::test_names_it"


def test_what_is_made_at_import_has_the_names_of_statement_and_class() -> None:
    source = "class A:\n    b: int = 1\n    def c(self, d=2):\n        return 3\n"
    assert {one.before: one.names for one in changes(source)} == {"1": ("b", "A"), "2": ("c", "A"), "3": ()}


def test_the_tables_count_and_a_survivor_is_judged_by_its_name() -> None:
    one = {"room": "cli", "file": "a.py", "line": 3, "kind": "constant", "before": "1", "after": "2", "tests": 1250}
    results = [
        one | {"name": name, "end": end} for name, end in (("x", "caught"), ("y", "survived"), ("z", "survived"))
    ]
    seen = Seen(9, results, {"y": "cosmetic: the width of a column"})
    assert [left["name"] for left in seen.unjudged] == ["z"]
    assert seen.by_room().splitlines()[-1] == "| all | 3 | 1 | 0 | 1 | 1 | 33% |"
    assert "| `a.py:3` | `1` | `2` | 1,250 | cosmetic: the width of a column |" in seen.each_survivor()


def test_every_judgement_is_of_a_change_that_there_is(product: list[Change]) -> None:
    names = {one.name for one in product}
    judged = tomllib.loads(JUDGED.read_text())
    assert [name for name in judged if name not in names] == []
    assert all(why.startswith(("equivalent: ", "cosmetic: ")) for why in judged.values())
