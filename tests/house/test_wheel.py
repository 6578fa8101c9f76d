"""One wheel, three import names, and all that they need at run time."""

import json
import re
import subprocess
import sys
import zipfile
from pathlib import Path, PurePosixPath

import pytest

IMPORT_NAMES = {"phongbench", "phongbench_api", "phongbench_reports"}
FOLDERS = (Path("phongbench"), Path("api/phongbench_api"), Path("reports/phongbench_reports"))


def build(root: Path, target: str, folder: Path) -> dict[PurePosixPath, str]:
    """Builds a wheel without network or build isolation; returns its files with their text (empty for binary ones)."""
    command = [sys.executable, "-m", "hatchling", "build", "-t", target, "-d", str(folder)]
    done = subprocess.run(command, cwd=root, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    [wheel] = folder.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        return {PurePosixPath(name): archive.read(name).decode(errors="replace") for name in archive.namelist()}


@pytest.fixture(scope="module")
def wheel(root: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[PurePosixPath, str]:
    return build(root, "wheel", tmp_path_factory.mktemp("wheel"))


def test_the_wheel_installs_three_prefixed_names_and_nothing_else(wheel: dict[PurePosixPath, str]) -> None:
    names = {path.parts[0] for path in wheel}
    assert {name for name in names if not name.endswith(".dist-info")} == IMPORT_NAMES


def test_the_wheel_holds_every_file_of_the_packages(
    root: Path, files: list[Path], wheel: dict[PurePosixPath, str]
) -> None:
    # Also the files that are not Python: templates, style sheets, py.typed.
    wanted = {
        PurePosixPath(folder.name, *file.relative_to(folder).parts)
        for folder in FOLDERS
        for file in files
        if file.is_relative_to(folder)
    }
    # The guide, which the service shows, lies beside the packages in a checkout.
    guide = Path("reports", "docs")
    wanted |= {PurePosixPath("phongbench_reports/docs", file.name) for file in files if file.parent == guide}
    held = {path for path in wheel if not path.parts[0].endswith(".dist-info")}
    assert held == wanted
    assert PurePosixPath("phongbench/py.typed") in held


def test_the_wheel_brings_the_page_with_all_it_loads_and_what_is_vendored(wheel: dict[PurePosixPath, str]) -> None:
    web = PurePosixPath("phongbench_api/web")
    page = wheel[web / "index.html"]
    loaded = {web / path for path in re.findall(r'(?:href|src)="\./web/([^"]+)"', page)}
    scripts = [text for path, text in wheel.items() if path.parent == web and path.suffix == ".js"]
    loaded |= {web / path for text in scripts for path in re.findall(r"from '\./([^']+)'", text)}
    assert loaded >= {web / "app.js", web / "style.css", web / "spheres.js", web / "vendor/uPlot.iife.min.js"}
    vendored = json.loads(wheel[web / "vendor/vendored.json"])["files"]
    assert loaded | {web / "vendor" / name for name in vendored} <= wheel.keys()
    assert PurePosixPath("phongbench_api/templates/docs.html.j2") in wheel


def test_the_wheel_holds_no_tests(wheel: dict[PurePosixPath, str]) -> None:
    # phongbench/testing.py is no test: it ships the checks for authors of approximations.
    assert not [path for path in wheel if "tests" in path.parts or path.name.startswith(("test_", "conftest"))]


def test_the_wheel_brings_the_command(wheel: dict[PurePosixPath, str]) -> None:
    [entry_points] = [text for path, text in wheel.items() if path.name == "entry_points.txt"]
    assert "phongbench = phongbench.cli.main:main" in entry_points


def test_an_editable_install_is_plain_folders(root: Path, tmp_path: Path) -> None:
    # One .pth of folders and no import hook, so that type checkers and editors follow it.
    editable = build(root, "wheel:editable", tmp_path)
    [folders] = [text for path, text in editable.items() if path.suffix == ".pth"]
    assert folders.split("\n") == [str(root), str(root / "api"), str(root / "reports")]
    assert not [path for path in editable if path.suffix == ".py"]
