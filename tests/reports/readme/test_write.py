"""Some parts of the pages may be written without the others."""

from pathlib import Path

from phongbench_reports.readme import parts
from phongbench_reports.readme.fill import write

ROOT = Path(__file__).parents[3]


def test_parts_that_are_not_given_stay_as_they_are(tmp_path: Path) -> None:
    before = parts.read(ROOT)
    for page, text in before.items():
        (tmp_path / page).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / page).write_text(text, encoding="utf-8")
    write(tmp_path, {"raw": "Answered."}, {})
    old, new = parts.parts_of(before), parts.parts_of(parts.read(tmp_path))
    assert new.pop("raw") == "Answered."
    old.pop("raw")
    assert new == old
