"""Ear clipping: a polygon with notches cut into triangles, in a time that grows little faster than its corners.

An ear is a corner that turns inwards and whose triangle holds no other corner; of these only blunt ones, which do not
turn inwards, can be held. Corners are tried in turn, around and around. What keeps the work small changes no result:

- a corner that was no ear is tried again only when a neighbour was cut off, or when the blunt corner that it was found
  to hold is no longer blunt;
- blunt corners lie in a tree of boxes, and only boxes that reach into a triangle are searched.

Source: G. H. Meisters, Polygons have ears, 1975.
"""

from collections.abc import Iterable, Iterator
from heapq import heappop, heappush

#: of a triangle that goes counter-clockwise, each with its direction and its end
Edges = list[tuple[float, float, float, float]]

#: corners of the tree's smallest boxes
_FEW = 16


def cut(x: list[float], y: list[float], flat: float) -> list[tuple[int, int, int]] | None:
    """The n - 2 triangles of a polygon that goes counter-clockwise; None if it crosses itself.

    x, y  (n,)  corners, n >= 3
    flat        twice the area that counts as none: corners on a straight line are cut off as triangles without area
                where there is no ear
    """
    return _Polygon(x, y, flat).triangles()


class _Polygon:
    """A polygon that loses its ears.

    before, after  the neighbours of each corner that is left
    ahead, behind  corners to be tried, from the present one to the last, and from the first to the present one
    waiting        for each blunt corner those that hold it
    """

    def __init__(self, x: list[float], y: list[float], flat: float) -> None:
        size = len(x)
        self.x, self.y, self.flat, self.left = x, y, flat, size
        self.before, self.after = [size - 1, *range(size - 1)], [*range(1, size), 0]
        self.ahead, self.behind = list(range(size)), list[int]()
        self.to_be_tried = [True] * size
        self.waiting: dict[int, list[int]] = {}
        self.blunt = _Tree(x, y, [self._turn(self.before[i], i, self.after[i]) <= flat for i in range(size)])

    def triangles(self) -> list[tuple[int, int, int]] | None:
        """All triangles, in the order in which they are cut off."""
        found: list[tuple[int, int, int]] = []
        following = 0
        while self.left > 3:
            corner = self._ear()
            if corner is None:
                corner = self._straight(self.after[following])
            if corner is None:
                return None
            found.append((self.before[corner], corner, self.after[corner]))
            following = self.after[corner]
            self._cut_off(corner)
        last = (self.before[following], following, self.after[following])
        return [*found, last] if self._turn(*last) >= -self.flat else None

    def _turn(self, a: int, b: int, c: int) -> float:
        """Twice the area of a triangle; positive if it goes counter-clockwise."""
        x, y = self.x, self.y
        return (x[b] - x[a]) * (y[c] - y[b]) - (y[b] - y[a]) * (x[c] - x[b])

    def _ear(self) -> int | None:
        """The next ear; None if no corner is one."""
        while self.ahead or self.behind:
            if not self.ahead:
                self.ahead, self.behind = self.behind, self.ahead
            corner = heappop(self.ahead)
            if not self.to_be_tried[corner]:
                continue
            self.to_be_tried[corner] = False
            if self.blunt.holds[corner]:
                continue
            held = self._held(corner)
            if held is None:
                return corner
            self.waiting.setdefault(held, []).append(corner)
        return None

    def _held(self, corner: int) -> int | None:
        """A blunt corner in the triangle of this one, or on its edges but not at its corners."""
        x, y, least = self.x, self.y, -self.flat
        ends = [(x[i], y[i]) for i in (self.before[corner], corner, self.after[corner])]
        edges = [(px - qx, py - qy, px, py) for (qx, qy), (px, py) in zip(ends, (*ends[1:], ends[0]), strict=True)]
        for p in self.blunt.near(edges, 4 * least):  # of boxes no less, however they are rounded
            place = px, py = x[p], y[p]
            for along, up, qx, qy in edges:
                if along * (py - qy) - up * (px - qx) < least:
                    break
            else:
                if place not in ends:
                    return p
        return None

    def _straight(self, start: int) -> int | None:
        """The first corner on a straight line, from this one on."""
        corner = start
        for _ in range(self.left):
            if abs(self._turn(self.before[corner], corner, self.after[corner])) <= self.flat:
                return corner
            corner = self.after[corner]
        return None

    def _cut_off(self, corner: int) -> None:
        """Take a corner away: its neighbours are tried anew, and those that held what is blunt no longer."""
        a, c = self.before[corner], self.after[corner]
        self.after[a], self.before[c] = c, a
        self.left -= 1
        self.to_be_tried[corner] = False
        again = [a, c]
        for i in (a, corner, c):
            blunt = i != corner and self._turn(self.before[i], i, self.after[i]) <= self.flat
            if self.blunt.holds[i] and not blunt:
                again += self.waiting.pop(i, ())
            self.blunt.put(i, blunt)
        for i in again:
            if i != corner and self.after[self.before[i]] == i and not self.to_be_tried[i]:
                self.to_be_tried[i] = True
                heappush(self.ahead if i > corner else self.behind, i)


class _Tree:
    """A set of corners, in a tree of boxes that are as small as the members of the set let them be.

    holds   whether each corner is in the set
    boxes   the least and largest x and y of members within; None for a box without any
    halves  the two boxes within a box; none within the smallest
    """

    def __init__(self, x: list[float], y: list[float], holds: list[bool]) -> None:
        self.x, self.y, self.holds = x, y, holds
        self.boxes: list[tuple[float, float, float, float] | None] = []
        self.halves: list[tuple[int, ...]] = []
        self.corners: list[list[int]] = []
        self.above: list[int] = []
        self.home = [0] * len(x)
        self._split(list(range(len(x))), -1)

    def _split(self, corners: list[int], above: int) -> int:
        """Make the box of these corners and those within it; its number."""
        number, x, y = len(self.boxes), self.x, self.y
        self.boxes.append(None)
        self.halves.append(())
        self.above.append(above)
        self.corners.append(corners)
        if len(corners) <= _FEW:
            for i in corners:
                self.home[i] = number
        else:
            across, along = [x[i] for i in corners], [y[i] for i in corners]
            wide = max(across) - min(across) > max(along) - min(along)
            corners = sorted(corners, key=(x if wide else y).__getitem__)
            middle = len(corners) // 2
            self.halves[number] = self._split(corners[:middle], number), self._split(corners[middle:], number)
        self._fit(number)
        return number

    def _fit(self, number: int) -> None:
        """Fit a box to its members, once those within it fit."""
        if self.halves[number]:
            inner = [box for half in self.halves[number] if (box := self.boxes[half])]
        else:
            inner = [(self.x[i], self.x[i], self.y[i], self.y[i]) for i in self.corners[number] if self.holds[i]]
        least, most, low, high = zip(*inner, strict=True) if inner else ((),) * 4
        self.boxes[number] = (min(least), max(most), min(low), max(high)) if inner else None

    def put(self, corner: int, member: bool) -> None:
        """Put a corner into the set or take it out."""
        if self.holds[corner] == member:
            return
        self.holds[corner] = member
        number = self.home[corner] if self.halves[0] else -1  # of a single box nobody asks where it is
        while number >= 0:
            before = self.boxes[number]
            self._fit(number)
            number = -1 if self.boxes[number] == before else self.above[number]

    def near(self, edges: Edges, least: float) -> Iterable[int]:
        """The members in boxes that are not wholly outside an edge: beyond it by twice an area, which is negative."""
        return self._search(edges, least) if self.halves[0] else [i for i in self.corners[0] if self.holds[i]]

    def _search(self, edges: Edges, least: float) -> Iterator[int]:
        numbers = [0]
        while numbers:
            number = numbers.pop()
            if (box := self.boxes[number]) is None:
                continue
            left, right, low, high = box
            for along, up, x, y in edges:
                if along * ((high if along > 0 else low) - y) - up * ((left if up > 0 else right) - x) < least:
                    break
            else:
                numbers += self.halves[number]
                if not self.halves[number]:
                    yield from (i for i in self.corners[number] if self.holds[i])
