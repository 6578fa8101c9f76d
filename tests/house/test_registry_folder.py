"""Adding an approximation is one file and one line: the list and the folder say the same."""

from collections.abc import Mapping, MutableMapping
from pathlib import Path

from phongbench.formulas.registry import FAMILIES, REGISTRY


def test_the_list_names_every_file_of_the_folder_once(root: Path) -> None:
    folder = {file.stem for file in (root / "phongbench" / "formulas" / "approximations").glob("*.py")} - {"__init__"}
    assert sorted(FAMILIES) == sorted(folder)


def test_the_registry_is_filled_and_read_only() -> None:
    assert isinstance(FAMILIES, tuple)
    assert isinstance(REGISTRY, Mapping)
    assert not isinstance(REGISTRY, MutableMapping)
    assert REGISTRY


def test_an_approximation_is_registered_under_its_own_name() -> None:
    assert {name: spec.name for name, spec in REGISTRY.items()} == {name: name for name in REGISTRY}
