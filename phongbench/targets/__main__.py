"""Write the shipped costs of the targets whose compilers are here: `python -m phongbench.targets [NAME..]`."""

import sys
from functools import cache
from pathlib import Path

from phongbench.errors import PhongbenchError
from phongbench.support.atomic_files import write_text, write_whole
from phongbench.targets.chips import TARGETS, target_named
from phongbench.targets.code_shapes import catalogue
from phongbench.targets.costs import FOLDER, as_text, compiled
from phongbench.targets.target import Target


def write(target: Target, folder: Path = FOLDER) -> Path:
    """Compile every formula of the full study for the target and write its costs; the file."""
    text = as_text(compiled(target, _codes(target.language)))
    path = folder / f"{target.name}.json"
    write_whole(path, lambda file: write_text(file, text))
    return path


_codes = cache(catalogue)


def main(names: list[str]) -> int:
    """Write what can be written, saying why the rest cannot; exit code 1 if anything cannot."""
    failed = 0
    for target in [target_named(name) for name in names] or TARGETS.values():
        try:
            sys.stdout.write(f"{write(target)}\n")
        except PhongbenchError as problem:
            failed = 1
            sys.stderr.write(f"{target.name}: {problem}\n")
    return failed


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except PhongbenchError as problem:
        sys.exit(f"phongbench.targets: {problem}")
