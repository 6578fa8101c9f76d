"""Every command that README and guide show is run, in the order of a reader who measures first and then asks.

One folder holds what the pages take for granted: a formula, materials, pictures, a request. What would take minutes,
go on for ever or need a network is run smaller or not at all, and SMALLER and ELSEWHERE say why.
"""

import json
import os
import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from phongbench.cli.main import main

ROOT = Path(__file__).resolve().parents[2]
CONTRIBUTING = ROOT / "CONTRIBUTING.md"
PAGES = [ROOT / "README.md", *sorted((ROOT / "reports" / "docs").glob("*.md"))]
STUDIES = ROOT / "reports" / "docs" / "studies.md"

#: of a study: as small as one can be that still measures
TINY = "--gamma 8 --samples 2000 --probe none --no-report"
UNTIMED = f"{TINY} --lambda dot --no-timing"


class Changed(NamedTuple):
    """What is added to the commands that a pattern matches, and why; options given later count."""

    pattern: str
    added: str
    why: str


#: the first that matches counts
SMALLER = (
    Changed(r"run --dry-run", "", "it measures nothing"),
    Changed(
        r"run --scenes",
        "--dry-run --only lyon --lambda dot --gamma 8 --precision float32",
        "draws all scenes by all formulas; tests/phongbench/study does it small",
    ),
    Changed(
        r"run --precision",
        "few.toml --dry-run --only lyon --lambda dot --gamma 8",
        "more precisions to compile, of fifty formulas that remove lengths too; tests/phongbench/accuracy runs them",
    ),
    Changed(r"run --with", f"{UNTIMED} --precision float32 --alpha 10 --target rdna2", "minutes, fifteen compilers"),
    Changed(r"run --alpha", f"{UNTIMED} --precision float32 --only lyon", "minutes"),
    Changed(r"run --materials", f"{UNTIMED} --precision float32 --only lyon", "minutes"),
    Changed(r"run --preset", f"{UNTIMED} --precision float32 --only lyon --alpha 10,50", "an hour"),
    Changed(
        r"run$", f"{TINY} --precision float32 --only lyon,gaussian --alpha 10,50,200 --timing-budget 8", "a minute"
    ),
    Changed(r"render \S+ --formulas", "--size 16x9", "a second for each of fourteen formulas"),
    Changed(r"render chequerboard", "--size 160x90", "nothing depends on the number of pixels"),
    Changed(r"render test-card --specular", "--size 160x90", "FLIP takes a second for a large picture"),
    Changed(r"inverse learn", "--synthetic 3 --components 2", "drawing sixty heads"),
)
#: not run here
ELSEWHERE = {
    r"phongbench serve": "serves until it is stopped: tests/api/test_serve.py starts and stops it",
    r"phongbench render \S+ --bench": "measures for seconds: tests/phongbench/scenes/test_render_command.py, small",
    r"make (?:run|test|check|docs|bench|bench-api|soak|help)": "make itself, installing: CI runs check and test",
    r"phongbench (?:run --shard|merge)": "two studies and a third: tests/phongbench/study/test_shards.py",
    r"phongbench (?:run|render \S+) --cluster": "needs workers: tests/phongbench/study/test_cluster.py starts them",
    r"curl": "tests/api/test_guide.py sends them to a server",
}


def blocks(file: Path, language: str) -> list[str]:
    """The fenced blocks of that language in a Markdown file."""
    return re.findall(rf"^```{language}\n(.*?)^```$", file.read_text(), re.DOTALL | re.MULTILINE)


def shown() -> list[str]:
    """Every command of README and guide, once; studies first, the timed one last of them."""
    lines = [line for page in PAGES for block in blocks(page, "console") for line in block.splitlines()]
    bare = [line.removeprefix("$ ").split(" #")[0].strip() for line in lines if line.startswith("$ ")]
    return sorted(dict.fromkeys(bare), key=lambda one: (not one.startswith("phongbench run"), one == "phongbench run"))


def elsewhere(command: str) -> bool:
    return any(re.match(pattern, command) for pattern in ELSEWHERE)


def change(words: str) -> Changed | None:
    """What is done to a command, of which `phongbench` is left out."""
    return next((one for one in SMALLER if re.match(one.pattern, words)), None)


RUN_HERE = [command for command in shown() if not elsewhere(command)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Where all of them are run, with the files that they name."""
    here = tmp_path_factory.mktemp("reader")
    (here / "few.toml").write_text('raw = "phong/each"')
    (here / "rational.py").write_text(blocks(CONTRIBUTING, "python")[0])
    (here / "scene.mtl").write_text("newmtl gold\nNs 51.2\nnewmtl chalk\nNs 0\n")
    (here / "request.json").write_text(json.dumps(REQUEST))
    (here / "lights.json").write_text(json.dumps({"lights": [{"direction": light} for light in LIGHTS.values()]}))
    normals = dome(48)
    for name, light in LIGHTS.items():
        save(here / f"{name}.png", 0.8 * normals @ (np.array(light) / np.linalg.norm(light)))
    normals = dome(64)  # as large as the heads that `inverse learn` draws
    save(here / "face.png", 0.1 + 0.7 * normals @ (np.array([0.3, 0.2, 1.0]) / np.linalg.norm([0.3, 0.2, 1.0])))
    angles = np.linspace(-1.2, 1.2, 60)
    (here / "scan.csv").write_text("\n".join(f"{0.1 + 0.7 * max(0, np.cos(a - 0.785)):.4f}" for a in angles))
    before = Path.cwd()
    os.chdir(here)
    yield here
    os.chdir(before)


LIGHTS = {"front": [0.0, 0.1, 1.0], "left": [-0.4, 0.0, 1.0], "right": [0.4, 0.0, 1.0]}
REQUEST = {
    "model": "phong",
    "specular": {"approximation": "lyon", "lambda": "dot", "gamma": 8},
    "material": {"ambient": [0.1] * 3, "diffuse": [0.5] * 3, "specular": [1.0] * 3, "shininess": 50},
    "lights": [{"direction": [0, 0, 1], "diffuse": [1, 1, 1], "specular": [1, 1, 1]}],
    "viewer": {"direction": [0, 0, 1]},
    "points": [[0, 0, 0]],
    "normals": [[0, 0, 1]],
}


def dome(across: int) -> np.ndarray:
    """(across, across, 3) unit normals of a gentle dome; y up."""
    y, x = np.mgrid[0.3 : -0.3 : across * 1j, -0.3 : 0.3 : across * 1j]
    normals = np.dstack([x, y, np.ones_like(x)])
    return normals / np.linalg.norm(normals, axis=2)[..., None]


def save(path: Path, light: np.ndarray) -> None:
    """Linear light as sRGB codes, by the standard's formula."""
    encoded = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    Image.fromarray((255 * encoded + 0.5).astype(np.uint8)).save(path)


@pytest.mark.parametrize("command", RUN_HERE)
def test_a_command_shown_does_what_it_says(folder: Path, command: str) -> None:
    program, words = command.split(" ", 1)
    assert program == "phongbench"
    changed = change(words)
    found = CliRunner().invoke(main, [*shlex.split(words), *shlex.split(changed.added if changed else "")])
    # 1 where two runs differ, which `compare` is there to find
    assert found.exit_code in ((0, 1) if words.startswith("compare") else (0,)), found.output
    assert found.output.strip()
    for option, name in zip(words.split(), words.split()[1:], strict=False):
        if option in ("--out", "--heights", "--figure"):
            assert (folder / name).exists()


def test_the_files_and_rows_are_as_the_pages_say(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    # needs the commands above
    runs = [json.loads(file.read_text()) for file in folder.glob("*/*/manifest.json")]
    plans = [run["plan"] for run in runs]
    assert any(51.2 in plan["alphas"] for plan in plans)
    assert any("rational" in json.dumps(plan) for plan in plans)
    [script] = [block for block in blocks(STUDIES, "python") if "read_parquet" in block]
    exec(compile(script, "studies.md", "exec"), {})
    assert "lyon" in capsys.readouterr().out


def test_the_plan_file_of_the_guide_is_taken(folder: Path) -> None:
    (folder / "plan.toml").write_text(blocks(STUDIES, "toml")[0] + 'approximations = ["lyon"]\n')
    found = CliRunner().invoke(main, ["run", "plan.toml", *TINY.split(), "--precision", "float32", "--dry-run"])
    assert found.exit_code == 0, found.output


def test_what_is_changed_or_left_out_is_shown_somewhere() -> None:
    left, small = [c for c in shown() if elsewhere(c)], [c.removeprefix("phongbench ") for c in RUN_HERE]
    assert [one for one in SMALLER if not any(change(words) is one for words in small)] == []
    assert [one for one in ELSEWHERE if not any(re.match(one, command) for command in left)] == []
    assert len(RUN_HERE) > 2 * len([c for c in left if c.startswith("phongbench")])
