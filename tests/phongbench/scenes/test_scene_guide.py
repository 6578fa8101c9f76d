"""The guide's page on scene files: its example is a scene, its table holds every key that the reader knows."""

import copy
import re
import tomllib
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from phongbench.errors import UnknownNameError
from phongbench.scenes.render import render
from phongbench.scenes.scene import Scene
from phongbench.scenes.scene_files import scene_of
from phongbench.support.document_paths import Source
from phongbench.support.documents import Table

PAGE = (Path(__file__).resolve().parents[3] / "reports" / "docs" / "pictures.md").read_text()
[EXAMPLE] = re.findall(r"^```toml\n(.*?)^```$", PAGE, re.DOTALL | re.MULTILINE)
ROWS = [
    (key, default)
    for keys, default in re.findall(
        r"^\| (`[\w.\[\]]+`(?:, `[\w.\[\]]+`)*) \| [^|]* \| ([^|]*) \|$", PAGE, re.MULTILINE
    )
    for key in re.findall(r"`([^`]+)`", keys)
]
DEFAULTS = [(key, default.strip("`")) for key, default in ROWS if default.startswith("`")]
#: which member of the example's lists and names has a key that not all have
AT = {"attenuation": 1, "point": 0, "normal": 0, "NAME": "slate", "side": "board"}


def scene(document: dict[str, Any]) -> Scene:
    return scene_of(Table.of(document, Source("my-scene.toml"), "scene"), "my-scene", Path())


def content(value: Any) -> Any:
    """What a scene holds, to be compared."""
    if is_dataclass(value) and not isinstance(value, type):
        return type(value).__name__, *(content(getattr(value, field.name)) for field in fields(value) if field.repr)
    if isinstance(value, list | tuple):
        return tuple(map(content, value))
    return (value.shape, value.tobytes()) if isinstance(value, np.ndarray) else repr(value)


def place(document: dict[str, Any], key: str) -> tuple[dict[str, Any], str]:
    """The table of the example that a key of the guide belongs to, and the key's last part."""
    *path, last = key.split(".")
    table: Any = document
    for step in path:
        if step == "NAME":
            table = table[AT.get(last, AT["NAME"])]
        elif step.endswith("[]"):
            table = table[step[:-2]][AT.get(last, -1 if step == "objects[]" else 0)]
        else:
            table = table[step]
    return table, last


def test_the_example_is_drawn() -> None:
    made = scene(tomllib.loads(EXAMPLE))
    assert {type(thing).__name__ for thing in made.objects} == {"Plane", "Sphere", "Mesh"}
    picture = render(made, size=(32, 18)).picture
    assert np.isfinite(picture).all()
    assert picture.std() > 0.01


def test_the_table_holds_every_key_that_the_reader_asks_for_and_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: set[str] = set()
    known = Table.has

    def has(self: Table, key: str) -> bool:
        steps = "".join("[]" if isinstance(step, int) else f".{step}" for step in self.steps)
        asked.add(re.sub(r"^materials\.\w+", "materials.NAME", f"{steps}.{key}".lstrip(".")))
        return known(self, key)

    monkeypatch.setattr(Table, "has", has)
    scene(tomllib.loads(EXAMPLE))
    leaves = {key for key in asked if not any(other.startswith((f"{key}.", f"{key}[]")) for other in asked)}
    told = {key for key in leaves | {"materials.NAME.fresnel"} if ".fresnel." not in key}
    assert {key for key, _ in ROWS} == told


@pytest.mark.parametrize(("key", "default"), DEFAULTS)
def test_a_key_left_out_is_what_the_table_says(key: str, default: str) -> None:
    without, with_it = (tomllib.loads(EXAMPLE) for _ in range(2))
    value = tomllib.loads(f"value = {default}")["value"]
    for document, change in ((without, lambda t, k: t.pop(k, None)), (with_it, lambda t, k: t.update({k: value}))):
        change(*place(document, key))
    assert content(scene(without)) == content(scene(with_it))


@pytest.mark.parametrize(
    "key", [key for key, default in ROWS if default == "needed" and key not in ("objects[].centre", "objects[].radius")]
)
def test_a_needed_key_is_asked_for(key: str) -> None:
    document = copy.deepcopy(tomllib.loads(EXAMPLE))
    table, last = place(document, key)
    del table[last]
    with pytest.raises(Exception, match=last):
        scene(document)


def test_another_key_is_refused_by_name() -> None:
    with pytest.raises(UnknownNameError, match="glossiness"):
        scene(tomllib.loads(EXAMPLE.replace("reflectivity", "glossiness")))
