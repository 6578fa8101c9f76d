"""A user's own formula in pictures: by the command, by a scene's material, and where it fails."""

import json
import re
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from phongbench.cli.main import main
from phongbench.errors import InputError
from phongbench.formulas.formula import Formula
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.user_files import registry_with
from phongbench.scenes import picture_errors
from phongbench.scenes.render import render
from phongbench.scenes.scene_files import read_scene

Own = Callable[..., Path]
OURS = Path(sys.modules["phongbench.formulas.approximations.lyon"].__file__ or "")
SMALL = ("--size", "32x18", "--depth", "1")
#: what of Lyon's file is replaced, so that it loads, but fails where a scene's exponent is not that of the trial
RAISES = ('"beta": ', '"beta": s.alpha and 1 / (s.alpha == 10) and ')
LINE = 1 + OURS.read_text().split(RAISES[0])[0].count("\n")
NO_NUMBER = ("return elementary", "return (cosine_deficit - cosine_deficit) / (beta - beta) + elementary")


def run(*arguments: str | Path) -> Result:
    """Runs `phongbench render`."""
    return CliRunner().invoke(main, ["render", *map(str, arguments)])


def test_lyon_under_another_name_draws_lyons_picture_bit_for_bit(own: Own, tmp_path: Path) -> None:
    file = own("mine")
    for name, options in (("lyon", ()), ("mine", ("--with", file))):
        done = run("chequerboard", *options, "--specular", f"{name}:dot:8", *SMALL, "--out", tmp_path / f"{name}.npy")
        assert done.exit_code == 0, done.output
    assert np.array_equal(np.load(tmp_path / "mine.npy"), np.load(tmp_path / "lyon.npy"))
    assert "mine" not in REGISTRY


def test_a_material_may_name_it(own: Own, small: str, tmp_path: Path) -> None:
    """Read from a file, and compared with exact Phong, whatever the material asks for."""
    found = {}
    for name in ("lyon", "mine"):
        scene = tmp_path / "scene.toml"
        scene.write_text(small.replace("shininess = 20", f'shininess = 20\napproximation = "{name}:cross:4"'))
        done = run(scene, "--with", own("mine"), *SMALL, "--compare", "--out", tmp_path / f"{name}.png", "--json")
        assert done.exit_code == 0, done.output
        found[name] = json.loads(done.stdout)["error"]
    assert found["mine"] == found["lyon"]
    assert found["mine"]["max_abs"] > 0


def test_without_its_file_it_is_refused_with_the_line(small: str, tmp_path: Path, own: Own) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(small.replace("shininess = 20", 'shininess = 20\napproximation = "mine:dot:8"'))
    with pytest.raises(InputError, match="unknown approximation 'mine'") as refused:
        read_scene(scene)
    assert str(refused.value.where).startswith(f"{scene}:17: materials.white.approximation")
    read = read_scene(scene, registry_with([own("mine")]))
    with pytest.raises(InputError, match="unknown approximation 'mine'"):
        render(read, size=(8, 8))


@pytest.mark.parametrize(
    ("broken", "words"), [(RAISES, f"broken.py:{LINE}: ZeroDivisionError"), (NO_NUMBER, "pixels are no numbers")]
)
def test_where_it_fails_the_error_says_so_and_nothing_is_written(
    own: Own, tmp_path: Path, broken: tuple[str, str], words: str
) -> None:
    out = tmp_path / "new" / "a.png"
    file = own("broken", *broken)
    done = run("test-card", "--with", file, "--specular", "broken:dot:8", *SMALL, "--out", out)
    assert done.exit_code == 2, done.output
    assert words in done.stderr
    assert "Traceback" not in done.output
    assert not out.parent.exists()


def test_it_is_drawn_beside_ours_and_what_fails_leaves_its_own_row_alone(own: Own) -> None:
    registry = registry_with([own("mine"), own("raises", *RAISES), own("none", *NO_NUMBER)])
    asked = [Formula.of(name, "dot", 8, registry=registry) for name in ("raises", "none", "mine", "lyon")]
    raises, none, mine, lyon = picture_errors.compare(read_scene("test-card"), asked, size=(32, 18), registry=registry)
    assert f"raises.py:{LINE}: ZeroDivisionError" in raises["left_out"]
    assert "are not finite" in none["left_out"]
    assert "max_abs" not in {*raises, *none}
    assert mine == lyon | {"formula": "mine:dot:8", "approximation": "mine"}


def test_a_lobe_that_is_not_finite_is_told_even_where_no_pixel_shows_it(own: Own) -> None:
    """Not a number at 60 degrees and beyond: no pixel of a matt scene looks."""
    hidden = ("return elementary", "return elementary.square_root(0.5 - cosine_deficit) * 0.0 + elementary")
    scene = read_scene("test-card")
    card = replace(scene, lights=tuple(replace(light, specular=(0.0, 0.0, 0.0)) for light in scene.lights))
    registry = registry_with([own("hidden", *hidden)])
    formula = Formula.of("hidden", "dot", 8, registry=registry)
    (row,) = picture_errors.compare(card, [formula], size=(8, 8), registry=registry)
    assert re.search(r"its lobe is not finite at 60(\.\d+)? degrees", row["left_out"])


def test_it_is_drawn_with_the_usual_lambda_forms_and_gammas(own: Own) -> None:
    forms = 'lambda_forms=("difference", "tan2"),\n    parameters='
    found = picture_errors.own(registry_with([own("mine"), own("other", "parameters=", forms)]))
    lyon = {(f.lambda_form, f.gamma) for f in picture_errors.USUAL if f.approximation == "lyon"}
    assert {(f.lambda_form, f.gamma) for f in found if f.approximation == "mine"} == lyon
    assert {(f.lambda_form, f.gamma) for f in found if f.approximation == "other"} == {
        ("difference", gamma) for _, gamma in lyon
    }
    assert not picture_errors.own(REGISTRY)


def test_the_command_judges_it_with_all_others(own: Own) -> None:
    done = run("test-card", "--with", own("mine"), "--formulas", "--specular", "mine:dot:4", "--size", "16x9", "--json")
    assert done.exit_code == 0, done.output
    (row,) = json.loads(done.stdout)["formulas"]
    assert (row["approximation"], row["gamma"]) == ("mine", 4)
