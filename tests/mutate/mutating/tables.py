"""What came of the changes, as tables of the guide and as data."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from phongbench_reports.readme.fill import write
from phongbench_reports.readme.markdown import table

_LONGEST = 60


@dataclass(frozen=True)
class Seen:
    """How many changes there are, what came of those that were tried, and what is judged of survivors."""

    possible: int
    results: Sequence[Mapping[str, Any]]
    judged: Mapping[str, str]

    @property
    def survivors(self) -> list[Mapping[str, Any]]:
        """Those that no test noticed, by place."""
        left = [one for one in self.results if one["end"] == "survived"]
        return sorted(left, key=lambda one: (one["file"], one["line"]))

    @property
    def unjudged(self) -> list[Mapping[str, Any]]:
        """Survivors that nobody has looked at."""
        return [one for one in self.survivors if not self._verdict(one)]

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        told = ("name", "end", "seconds", "line", "kind", "note", "tests")
        return {
            "possible": self.possible,
            "tried": len(self.results),
            "caught": len(self.results) - len(self.survivors),
            "unjudged": len(self.unjudged),
            "results": [{name: one[name] for name in told} for one in self.results],
        }

    def write(self, checkout: Path) -> None:
        """Fill the guide's parts."""
        write(checkout, {"mutations": self.by_room(), "survivors": self.each_survivor()})

    def by_room(self) -> str:
        """A line for each room: changes tried, noticed and not."""
        rooms: dict[str, list[Mapping[str, Any]]] = {}
        for one in sorted(self.results, key=lambda one: str(one["room"])):
            rooms.setdefault(one["room"], []).append(one)
        lines = [self._line(f"`{room}`", results) for room, results in rooms.items()]
        headings = ["room", "changed", "caught", "out of time", "survived: equivalent or cosmetic", "to do", "caught"]
        return table(headings, [*lines, self._line("all", self.results)], right=range(1, len(headings)))

    def _line(self, name: str, results: Sequence[Mapping[str, Any]]) -> list[str]:
        ends = [one["end"] for one in results]
        judged = sum(bool(self._verdict(one)) for one in results if one["end"] == "survived")
        caught, late, left = (ends.count(end) for end in ("caught", "out of time", "survived"))
        share = f"{(caught + late) / max(1, len(ends)):.0%}"
        return [name, *(f"{number:,}" for number in (len(ends), caught, late, judged, left - judged)), share]

    def each_survivor(self) -> str:
        """A line for each survivor: where, what, how many tests were asked, and what is judged of it."""
        lines = [
            [
                f"`{one['file']}:{one['line']}`",
                _code(one["before"]),
                _code(one["after"]),
                f"{one['tests']:,}",
                self._verdict(one) or "to do",
            ]
            for one in self.survivors
        ]
        return table(["where", "was", "became", "tests", "judged"], lines, right=[3])

    def _verdict(self, one: Mapping[str, Any]) -> str:
        return self.judged.get(str(one["name"]), "")


def _code(text: str) -> str:
    return f"`{text if len(text) <= _LONGEST else text[: _LONGEST - 3] + '...'}`"
