"""Some parts of the README may be written without the others."""

from pathlib import Path

from phongbench_reports.readme import parts
from phongbench_reports.readme.fill import write

ROOT = Path(__file__).parents[3]


def test_parts_that_are_not_given_stay_as_they_are(tmp_path: Path) -> None:
    before = parts.read(ROOT)
    (tmp_path / parts.README).write_text(before, encoding="utf-8")
    write(tmp_path, {"raw": "Answered."}, {})
    old, new = parts.parts_of(before), parts.parts_of(parts.read(tmp_path))
    assert new.pop("raw") == "Answered."
    old.pop("raw")
    assert new == old
