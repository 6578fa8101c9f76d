"""The recipes of reports/docs/python.md, and the README's, run as they stand."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
GUIDE = ROOT / "reports" / "docs" / "python.md"


def blocks(page: Path) -> list[str]:
    return re.findall(r"^```python\n(.*?)^```$", page.read_text(), re.DOTALL | re.MULTILINE)


def test_there_are_eleven_recipes() -> None:
    numbers = re.findall(r"^## (\d+)\. ", GUIDE.read_text(), re.MULTILINE)
    assert numbers == [str(n) for n in range(1, 12)]
    assert len(blocks(GUIDE)) > 10


def test_the_recipes_run_one_after_the_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for block in blocks(GUIDE):
        exec(compile(block, "python.md", "exec"), names)
    assert names["front"]["state"].isin(["on", "off", "unresolved"]).all()  # type: ignore[index]
    made = {path.name for path in tmp_path.iterdir()} - {"__pycache__"}
    assert made == {"chequerboard.png", "phongbench-runs", "rational.py"}
    shown = capsys.readouterr().out
    assert "laws" in shown
    assert "fn highlight(" in shown
    assert "lyon needs a gamma" in shown
    # a mirror would be pressed by (1 + share) cos(60), and dragged by (1 - share) sin(60) of flux cos(60) / c
    pressed, dragged = (-1e6 * names["force"]).tolist()  # type: ignore[operator]
    assert 0.97 * 1.816 < pressed < 1.816
    assert 0.786 < dragged < 1.1 * 0.786


def test_the_example_of_the_readme_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    [example] = [block for block in blocks(ROOT / "README.md") if "pb.specular" in block]
    names: dict[str, object] = {}
    exec(compile(example, "README.md", "exec"), names)
    assert names["values"].shape == (1000,)  # type: ignore[attr-defined]
