"""A file of materials is answered for each that has a highlight."""

from pathlib import Path

import pytest

from phongbench.analysis.material_advice import for_materials


@pytest.mark.parametrize(("dull", "said"), [("chalk", "positive Ns: chalk"), ("a b c d e", "Ns: a, b, c and 2 more")])
def test_materials_without_a_highlight_are_told_and_not_answered(tmp_path: Path, dull: str, said: str) -> None:
    file = tmp_path / "scene.mtl"
    materials = {"gold": "Ns 51.2", **dict.fromkeys(dull.split(), "Ns 0"), "jade": "Ns 76.8"}
    file.write_text("".join(f"newmtl {name}\n{line}\n" for name, line in materials.items()))
    found = for_materials(None, file, ["cpu"], max_error=0.02)
    assert [one["material"] for one in found["materials"]] == ["gold", "jade"]
    [note] = found["notes"]
    assert note.endswith(said)
