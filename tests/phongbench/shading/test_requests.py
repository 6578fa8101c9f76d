"""The shading request as a document: what it may hold, what it must, and how it says what is wrong."""

import copy
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from phongbench.cli.main import main
from phongbench.compiler import jit
from phongbench.errors import InputError
from phongbench.formulas.fresnel.reflectance import Fresnel
from phongbench.shading.requests import parse_json, shaded_json, shading_request
from phongbench.shading.shade import Formula, Ledger, Light, Material, Shaded, Viewer, shade

REQUEST: dict[str, Any] = {
    "model": "phong",
    "specular": {"approximation": "lyon", "lambda": "cross", "gamma": 8, "beta": "taylor"},
    "material": {"ambient": [0.1, 0.1, 0.1], "diffuse": [0.5, 0.5, 0.5], "specular": [1, 0.9, 0.8], "shininess": 50},
    "ambient_light": [1, 1, 1],
    "lights": [
        {"direction": [0, 0, 2], "diffuse": [1, 1, 0.5]},
        {"position": [0, 3, 3], "attenuation": [1, 0.1, 0.01], "specular": [0, 1, 1], "reach": 100},
    ],
    "viewer": {"position": [0, 0, 5]},
    "points": [[0, 0, 0], [0.1, 0, 0], [0, 1, 0.5]],
    "normals": [[0, 0, 1], [0.1, 0, 1], [0, 1, 1.5]],
    "normalise": True,
}
compiled = pytest.mark.skipif(jit.DISABLED, reason="shading is compiled")


def changed(path: tuple[Any, ...], value: Any) -> dict[str, Any]:
    """The request with one member replaced, or taken out where the value is the KeyError type."""
    document = copy.deepcopy(REQUEST)
    place: Any = document
    for step in path[:-1]:
        place = place[step]
    if value is KeyError:
        del place[path[-1]]
    else:
        place[path[-1]] = value
    return document


@compiled
@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_a_request_is_the_call_of_shade_that_it_spells(precision: str) -> None:
    request = shading_request(parse_json(json.dumps({**REQUEST, "precision": precision})))
    direct = shade(
        np.array(REQUEST["points"], precision),
        np.array(REQUEST["normals"], precision),
        material=Material((0.1, 0.1, 0.1), (0.5, 0.5, 0.5), (1, 0.9, 0.8), 50.0),
        lights=(
            Light(direction=(0, 0, 2), diffuse=(1, 1, 0.5)),
            Light(position=(0, 3, 3), attenuation=(1, 0.1, 0.01), specular=(0, 1, 1), reach=100),
        ),
        viewer=Viewer(position=(0, 0, 5)),
        ambient_light=(1, 1, 1),
        specular=Formula.of("lyon", "cross", 8, "taylor"),
    )
    found = request.shade()
    assert found.colours.tobytes() == direct.colours.tobytes()
    assert found.ledger == direct.ledger
    assert request.pairs == found.ledger.pairs == 6
    answer = json.loads(shaded_json(found))
    assert np.array(answer["colours"], precision).tobytes() == found.colours.tobytes()
    assert answer["skipped"] == found.ledger.as_dict()


@compiled
def test_a_material_may_say_what_it_reflects_at_each_incidence_and_a_light_what_it_adds_everywhere() -> None:
    document = changed(("material", "fresnel"), {"kind": "f82", "f0": [0.9, 0.6, 0.5], "f82": [0.9, 0.7, 0.7]})
    document["lights"][1]["ambient"] = [0.1, 0.2, 0.3]
    request = shading_request(document)
    assert request.arguments["material"].fresnel == Fresnel("f82", f0=(0.9, 0.6, 0.5), f82=(0.9, 0.7, 0.7))
    assert request.arguments["lights"][1].ambient == (0.1, 0.2, 0.3)
    assert (request.shade().colours != shading_request(REQUEST).shade().colours).any()


@compiled
def test_vectors_may_come_apart_from_the_document() -> None:
    document = {k: v for k, v in REQUEST.items() if k not in ("points", "normals")}
    vectors = (np.array(REQUEST["points"], "f8"), np.array(REQUEST["normals"], "f8"))
    apart = shading_request(document, vectors).shade()
    assert apart.colours.dtype == np.float64
    whole = shading_request({**REQUEST, "precision": "float64"}).shade()
    assert apart.colours.tobytes() == whole.colours.tobytes()
    with pytest.raises(InputError, match="unknown key 'points'"):
        shading_request(REQUEST, vectors)


@compiled
def test_what_may_be_left_out_has_a_default() -> None:
    needed = {k: REQUEST[k] for k in ("material", "lights", "viewer", "points", "normals")}
    spelt = {
        "model": "phong",
        "specular": {"approximation": "phong"},
        "ambient_light": [0, 0, 0],
        "normalise": True,
        "precision": "float32",
    }
    assert (
        shading_request(needed).shade().colours.tobytes() == shading_request(needed | spelt).shade().colours.tobytes()
    )


@pytest.mark.parametrize(
    ("path", "value", "where", "says"),
    [
        (("colour",), 1, "colour", "unknown key 'colour'"),
        (("lights", 1, "colour"), 1, "lights[1].colour", "unknown key 'colour'"),
        (("material",), KeyError, "material", "missing"),
        (("points",), KeyError, "points", "missing"),
        (("material", "shininess"), KeyError, "material.shininess", "missing"),
        (("material", "shininess"), "50", "material.shininess", '"50" is not a number'),
        (("material", "shininess"), True, "material.shininess", "true is not a number"),
        (("material", "shininess"), 1e6, "material.shininess", "outside"),
        (("material", "diffuse"), [1, 1], "material.diffuse", "[1, 1] is not a list of 3 numbers"),
        (("material", "diffuse"), [1, 1, -1], "material.diffuse[2]", "at least 0"),
        (("material", "diffuse"), [1, None, 1], "material.diffuse[1]", "diffuse[1] = null is not a number"),
        (("material", "diffuse"), "red", "material.diffuse", "is not a list"),
        (("lights",), {}, "lights", "is not a list"),
        (("lights", 0), [], "lights[0]", "is not an object"),
        (("lights", 0, "direction"), [0, 0, 0], "lights[0].direction", "cannot be 0"),
        (("lights", 0, "position"), [0, 0, 0], "lights[0].direction", "both"),
        (("lights", 1, "attenuation"), [0, 0, 0], "lights[1].attenuation", "not all 0"),
        (("lights", 1, "attenuation"), [0, 0, 10**400], "lights[1].attenuation[2]", "no finite number"),
        (("lights", 1, "reach"), -1, "lights[1].reach", "finite number"),
        (("lights", 1, "ambient"), [1, 1], "lights[1].ambient", "is not a list of 3 numbers"),
        (("lights", 1, "ambient"), [1, 1, -1], "lights[1].ambient[2]", "at least 0"),
        (("material", "fresnel"), "glass", "material.fresnel", "is not an object"),
        (("material", "fresnel"), {}, "material.fresnel.kind", "missing"),
        (("material", "fresnel"), {"kind": "frensel"}, "material.fresnel.kind", "unknown kind"),
        (("material", "fresnel"), {"kind": "dielectric"}, "material.fresnel.n", "needs n"),
        (("material", "fresnel"), {"kind": "dielectric", "n": 1.5}, "material.fresnel.n", "is not a list of 3 numbers"),
        (("material", "fresnel"), {"kind": "dielectric", "n": [1, -1, 1]}, "material.fresnel.n", "outside"),
        (
            ("material", "fresnel"),
            {"kind": "conductor", "n": [1] * 3, "k": [1, 1, -2]},
            "material.fresnel.k",
            "outside",
        ),
        (("material", "fresnel"), {"kind": "schlick", "f0": [1] * 3, "k": [1] * 3}, "material.fresnel.k", "takes no k"),
        (("material", "fresnel"), {"kind": "schlick", "f0": [1, None, 1]}, "material.fresnel.f0[1]", "not a number"),
        (("material", "fresnel"), {"kind": "schlick", "f": [1] * 3}, "material.fresnel.f", "unknown key 'f'"),
        (("viewer",), {}, "viewer.direction", "neither"),
        (("model",), "gouraud", "model", "unknown model"),
        (("model",), ["phong"], "model", "is not a string"),
        (("specular", "approximation"), "lyonn", "specular.approximation", "unknown approximation"),
        (("specular", "lambda"), "dott", "specular.lambda", "unknown lambda form"),
        (("specular", "gamma"), 9, "specular.gamma", "power of two"),
        (("specular", "gamma"), 8.0, "specular.gamma", "8.0 is not a whole number"),
        (("specular", "gamma"), 2**70, "specular.gamma", "not a whole number from 1 to"),
        (("specular", "gamma"), None, "specular.gamma", "needs a gamma"),
        (("specular", "beta"), "steep", "specular.beta", "unknown beta policy"),
        (("specular", "beta"), -2, "specular.beta", "finite number"),
        (("normalise",), 1, "normalise", "neither true nor false"),
        (("precision",), "float16", "precision", "unknown precision"),
        (("points",), [[0, 0, 0]], "normals", "3 normals for 1 points"),
        (("points",), [0, 0, 0], "points[0]", "three numbers"),
        (("points", 1), [0, 0], "points[1]", "three numbers"),
        (("points", 2), [0, 0, "0"], "points[2]", "three numbers"),
        (("points", 2), [0, 0, True], "points[2]", "three numbers"),
        (("points", 2), {"x": 0}, "points[2]", "three numbers"),
        (("points", 2), [0, 0, 10**400], "points", "beyond"),
        ((), None, "document", "a shading request is a table"),
    ],
)
def test_what_is_wrong_is_named_by_its_path(path: tuple[Any, ...], value: Any, where: str, says: str) -> None:
    with pytest.raises(InputError) as caught:
        shading_request(changed(path, value) if path else value)
    assert caught.value.where == where
    assert says in caught.value.what


@compiled
@pytest.mark.parametrize(("bad", "name", "index"), [([0, 0, 1e300], "points", 2), ([0, 0, 0], "normals", 1)])
def test_the_first_bad_vector_is_named_when_shading(bad: list[float], name: str, index: int) -> None:
    with pytest.raises(InputError) as caught:
        shading_request(changed((name, index), bad)).shade()
    assert caught.value.where == f"{name}[{index}]"


@pytest.mark.parametrize("text", ["", "{", '{"a": NaN}', "[1,", '"\\ud800"', b"\xff\xfe", '{"a": 1e999'])
def test_what_is_not_json_says_where(text: str | bytes) -> None:
    with pytest.raises(InputError, match="not JSON") as caught:
        parse_json(text)
    assert "line" in str(caught.value.where)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.sampled_from(("position", "x", *REQUEST)), inner),
    max_leaves=12,
)
PLACES: list[tuple[Any, ...]] = [
    *((k,) for k in REQUEST),
    *(("material", k) for k in REQUEST["material"]),
    ("lights", 0),
    ("lights", 1, "position"),
    *(("specular", k) for k in REQUEST["specular"]),
    ("viewer", "position"),
    ("points", 1),
    ("normals", 2),
]


@given(st.sampled_from(PLACES), JSON)
def test_whatever_stands_anywhere_is_read_or_refused_by_name(path: tuple[Any, ...], value: Any) -> None:
    refused = None
    try:
        shading_request(changed(path, value))
    except InputError as problem:
        refused = problem
    assert refused is None or refused.where


@given(JSON)
def test_any_document_is_read_or_refused(value: Any) -> None:
    with pytest.raises(InputError):
        shading_request(value)


def test_what_is_not_finite_travels_as_a_string() -> None:
    colours = np.array([[np.nan, np.inf, -np.inf], [0.1, 0.2, 0.3]], np.float32)
    answer = json.loads(shaded_json(Shaded(colours, Ledger())))
    assert answer["colours"][0] == ["NaN", "Infinity", "-Infinity"]
    np.testing.assert_array_equal(np.array(answer["colours"][1], np.float32), colours[1])


# the command


@compiled
def test_the_command_shades_from_a_file_and_from_stdin(tmp_path: Path) -> None:
    file = tmp_path / "in.json"
    file.write_text(json.dumps(REQUEST))
    expected = json.loads(shaded_json(shading_request(REQUEST).shade()))
    by_file = CliRunner().invoke(main, ["shade", str(file)])
    by_stdin = CliRunner().invoke(main, ["shade", "-", "--threads", "2"], input=file.read_text())
    assert by_file.exit_code == by_stdin.exit_code == 0
    assert json.loads(by_file.stdout) == json.loads(by_stdin.stdout) == expected
    for name in ("out.json", "out.npy"):
        assert CliRunner().invoke(main, ["shade", str(file), "--out", str(tmp_path / name)]).exit_code == 0
    assert json.loads((tmp_path / "out.json").read_text()) == expected
    np.testing.assert_array_equal(np.load(tmp_path / "out.npy"), np.array(expected["colours"], np.float32))


@compiled
def test_the_command_takes_a_formula_of_the_users_own(tmp_path: Path) -> None:
    own = tmp_path / "own.py"
    own.write_text(
        Path(sys.modules["phongbench.formulas.approximations.schlick"].__file__ or "")
        .read_text()
        .replace('name="schlick"', 'name="own"')
    )
    document = json.dumps(changed(("specular",), {"approximation": "own"}))
    theirs = CliRunner().invoke(main, ["shade", "-", "--with", str(own)], input=document)
    assert theirs.exit_code == 0, theirs.output
    ours = shading_request(changed(("specular",), {"approximation": "schlick"})).shade()
    assert json.loads(theirs.stdout)["colours"] == json.loads(shaded_json(ours))["colours"]


@compiled
def test_what_the_users_formula_raises_is_told_with_its_line(tmp_path: Path) -> None:
    text = Path(sys.modules["phongbench.formulas.approximations.schlick"].__file__ or "").read_text()
    text = text.replace('name="schlick"', 'name="own"').replace("lambda s: {", "lambda s: 1 / (s.alpha == 10) and {")
    line = 1 + text.split("1 / (s.alpha")[0].count("\n")
    (tmp_path / "own.py").write_text(text)
    document = json.dumps(changed(("specular",), {"approximation": "own"}))
    found = CliRunner().invoke(main, ["shade", "-", "--with", str(tmp_path / "own.py")], input=document)
    assert (found.exit_code, found.stdout) == (2, "")
    assert f"own.py:{line}: ZeroDivisionError" in found.stderr


@pytest.mark.parametrize(
    ("arguments", "text", "says"),
    [
        (["-"], "{", "not JSON"),
        (["-"], json.dumps(changed(("lights", 1, "attenuation"), [0, 0, 0])), "lights[1].attenuation"),
        (["nowhere.json"], "", "No such file or directory"),
        (["-", "--out", "x.png"], json.dumps(REQUEST), "neither .json nor .npy"),
    ],
)
def test_wrong_input_is_two_lines_and_exit_code_2(arguments: list[str], text: str, says: str) -> None:
    found = CliRunner().invoke(main, ["shade", *arguments], input=text)
    assert found.exit_code == 2
    assert says in found.stderr
    assert len(found.stderr.strip().splitlines()) <= 2
    assert found.stdout == ""


@compiled
def test_missing_folders_are_made_and_a_folder_is_no_request(tmp_path: Path) -> None:
    out = tmp_path / "no" / "x.npy"
    assert CliRunner().invoke(main, ["shade", "-", "--out", str(out)], input=json.dumps(REQUEST)).exit_code == 0
    assert out.is_file()
    assert CliRunner().invoke(main, ["shade", str(tmp_path)]).exit_code == 2


def test_the_help_of_shade_imports_nothing_heavy() -> None:
    code = (
        "import sys\nfrom phongbench.cli.main import main\n"
        "try: main(['shade', '--help'])\nexcept SystemExit: pass\n"
        "assert not {'numpy', 'numba', 'orjson'} & set(sys.modules)"
    )
    assert "IN.json" in subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout
