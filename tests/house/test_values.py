"""Values are values: what the product's dataclasses hold does not change, but of classes that are named here."""

import ast
from pathlib import Path

import pytest

Options = dict[str, dict[str, bool]]

PRODUCT = ("phongbench", "api", "reports")
#: classes that hold what changes while work goes on
STATE = {
    "api/phongbench_api/service.py:Service",
    "phongbench/accuracy/device_errors.py:_Devices",
    "phongbench/accuracy/probes/probe.py:ProbeContext",
    "phongbench/accuracy/sweep.py:Sweep",
    "phongbench/benchmarks/kernel_bench.py:Entrant",
    "phongbench/benchmarks/numpy_tracer.py:_Tracer",
    "phongbench/benchmarks/scene_bench.py:_Entrant",
    "phongbench/formulas/shader_code/raw_vectors.py:Pair",
    "phongbench/scenes/skips.py:Tally",
    "phongbench/study/run.py:Outcome",
    "phongbench/study/run.py:_Study",
    "phongbench/study/shard_run.py:ShardOutcome",
    "phongbench/support/documents.py:Table",
    "phongbench/timing/session.py:Session",
}
USUAL = {"frozen": False, "slots": False, "eq": True, "order": False, "kw_only": False, "init": True, "repr": True}


@pytest.fixture(scope="module")
def options(root: Path) -> Options:
    """File and name of every dataclass -> the options of its decorator."""
    found: Options = {}
    for path in (path for folder in PRODUCT for path in sorted((root / folder).rglob("*.py"))):
        for node in ast.walk(ast.parse(path.read_text())):
            for decorator in getattr(node, "decorator_list", []) if isinstance(node, ast.ClassDef) else []:
                given = decorator.keywords if isinstance(decorator, ast.Call) else []
                if ast.unparse(decorator).partition("(")[0].endswith("dataclass"):
                    values = {str(option.arg): ast.literal_eval(option.value) for option in given}
                    found[f"{path.relative_to(root).as_posix()}:{node.name}"] = values
    return found


def test_classes_that_are_not_frozen_are_named_here(options: Options) -> None:
    assert {name for name, given in options.items() if not given.get("frozen")} == STATE


def test_no_option_repeats_what_goes_without_saying(options: Options) -> None:
    assert [(name, given) for name, given in options.items() if given.items() & USUAL.items()] == []
