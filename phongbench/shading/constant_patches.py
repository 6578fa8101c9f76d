"""Patches: blocks of points so small, or so far from a light, that its terms hardly change over them.

Over such a block L.N and R.V may be held constant, as the textbooks do it for far polygons: the light is computed once
for a block of 64 points and not at each of them. A light is held where the proven bound on what that changes is small
enough; the bounds of all lights that a block holds add up to no more than the budget it was given.

**The bound.** Points, normals and views of a block lie in balls: within r_p of a point p, r_n of a normal N, r_v of a
view V. A light at distance d from p then turns by no more than the chord r_l of an angle with sine r_p / d, and

    N.L  lies within (1 + |N|^2 - m^2) / 2, where m = |N - L| is known up to r_n + r_l, and |N|^2 up to its own spread
    R    lies within r_l + 2 r_n |N| + ... of the ball's R (the terms of second order are in the code)
    R.V  lies within (|R|^2 + |V|^2 - m^2) / 2, where m = |R - V| is known up to r_r + r_v; H and N.H likewise

Half of a squared chord is the deficit lambda itself, so on the peak the interval is of second order, as the lobe is.
The formula's own loop is evaluated at both ends of the interval; `Approximation.falls` says that all values lie between
them. The fading lies between those at d - r_p and d + r_p. A term is held at the middle of its interval, which is wrong
by half its width at most. `ROOM` roundings widen every interval. A light is not held by a block that is not all within
its reach, nor by one that sees it in part.
"""

from functools import cache
from typing import Any

import numpy as np

from phongbench.compiler import intrinsics, jit
from phongbench.compiler.lowering import Precision, lower
from phongbench.compiler.precisions import Array
from phongbench.formulas import coordinate_kernels, lambda_forms
from phongbench.shading import bounding_spheres, reach_bounds
from phongbench.shading import tiles as at
from phongbench.shading.bounding_spheres import LENGTH, NORMAL, POINT, SIZE, VIEW

#: lights that are estimated together: two vectors of 16 float32. Their rows are a known distance apart, or no loop over
#: them would vectorise
WIDTH = 32
#: rows of the working memory for so many lights: ends of cosine * fading, of the fading, of the formula's coordinate,
#: its gates and its values (the brighter end first); the bound; then the lights' numbers
DIM, BRIGHT, FADED, FADING, AT, GATES, VALUES, LOSS, COLUMNS = (WIDTH * row for row in (0, 1, 2, 3, 4, 6, 8, 10, 11))
ROWS = COLUMNS + WIDTH * at.NUMBERS
#: rows of sums: red, green and blue that are held, the bounds, how many
_SUMS = 5
#: what is told about a tile: its first point, how many it holds, its blocks; the formula's loop; whether there are
#: views, and shadows
FIRST, INSIDE, USED, FORMULA, VIEWS, SHADOWS = range(6)
INFO = 6
#: times that the threshold is halved in search of lights that fit into the budget together
_HALVINGS = 10
#: roundings at 1 that a cosine, a chord or a deficit may be wrong by
ROOM = 16


def patch_signature(dtype: Any) -> Any:
    """Of `patch_loop`: (s, rows of lights, verdicts, visible, info, held, counts, lost, coefficients, table, limits,
    work)."""
    row, whole = jit.array_type(dtype), jit.array_type(np.int64)
    return jit.signature(
        row,
        jit.array_type(dtype, 2),
        row,
        jit.array_type(np.uint8, 2, readonly=True),
        whole,
        whole,
        whole,
        row,
        row,
        row,
        row,
        row,
    )


patch_at = intrinsics.function_at(patch_signature)


@jit.inline
def room(lights: Any) -> Any:
    """Numbers of working memory that so many lights need."""
    return (lights + WIDTH - 1) // WIDTH * ROWS + _SUMS * WIDTH + SIZE


@jit.inline
def words(lights: Any) -> Any:
    """Entries of `held` that so many lights need."""
    return 3 * lights + (lights + WIDTH - 1) // WIDTH * WIDTH


@jit.inline
def _seen(visible: Any, row: Any, info: Any, b: Any) -> Any:
    """Whether all points of a block see a light."""
    first = info[FIRST] + b * at.BLOCK
    seen = True
    for i in range(first, min(first + at.BLOCK, info[FIRST] + info[INSIDE])):
        seen = seen and visible[row, i] != 0
    return seen


@cache
def patch_loop(space: str, form: str, precision: Precision) -> Any:
    """The loop over the blocks of a tile that decides which lights each of them holds, and adds what these give.

    s         the tile, loaded; its sums are added to
    held      int64 (`words`,)  out: a bit for each block that holds the light; room for as many names; in: the row of
                              `visible` of each light, and room for bits
    counts    at.COUNTS        the pairs held are added
    lost      losses.LOSSES    raised to the largest sum of bounds that a block holds
    limits    limits[at.BUDGET] is what a block may lose
    work      `room` for the lights
    """
    zero, one, two, half = map(precision.constant, (0.0, 1.0, 2.0, 0.5))
    info_of = np.finfo(precision.carrier)
    most, tiny, room_for = info_of.max, info_of.tiny, precision.carrier.type(ROOM * info_of.eps)
    endless = precision.constant(np.inf)
    dot = lower(lambda_forms.dot, precision)
    entry, put, select = intrinsics.entry, intrinsics.put, intrinsics.select
    halfway, plain = space == "half", form == "none"
    cross, tangent, dotted = form in ("cross", "tan2"), form == "tan2", form == "dot"
    four, three = precision.constant(4.0), precision.constant(3.0)

    @jit.inline
    def chord(sine: Any) -> Any:
        """Of the angle with this sine; endless from a right angle on."""
        squared = sine * sine
        inside = select(squared < one, one - squared, zero)
        return select(squared < one, sine * np.sqrt(two / (one + np.sqrt(inside))), endless)

    @jit.inline
    def estimate(ball: Any, w: Any, base: Any) -> None:
        """The ends of every light's terms over a ball."""
        px, py, pz, rp = ball[POINT], ball[POINT + 1], ball[POINT + 2], ball[POINT + 3]
        nx, ny, nz, rn = ball[NORMAL], ball[NORMAL + 1], ball[NORMAL + 2], ball[NORMAL + 3]
        vx, vy, vz, rv = ball[VIEW], ball[VIEW + 1], ball[VIEW + 2], ball[VIEW + 3]
        length, spread = ball[LENGTH], ball[LENGTH + 1] + room_for
        low, high = length - spread - one, length + spread - one
        stretch = max(one, one + two * high)
        size = np.sqrt(length)
        for j in range(WIDTH):
            k = base + j
            placed = entry(w, COLUMNS + WIDTH * at.PLACED + k)
            x = entry(w, COLUMNS + WIDTH * at.WHERE + k) - placed * px
            y = entry(w, COLUMNS + WIDTH * (at.WHERE + 1) + k) - placed * py
            z = entry(w, COLUMNS + WIDTH * (at.WHERE + 2) + k) - placed * pz
            squared = dot(x, y, z, x, y, z)
            inverse = one / np.sqrt(squared)
            distance = squared * inverse
            x, y, z = x * inverse, y * inverse, z * inverse
            extent = placed * rp * (one + room_for)
            rl = chord(extent * inverse) + room_for
            # N.L, by the chord between them and by its own slope: the one is tighter near the peak, the other beside it
            cosine = dot(nx, ny, nz, x, y, z)
            dx, dy, dz = nx - x, ny - y, nz - z
            apart = np.sqrt(dot(dx, dy, dz, dx, dy, dz))
            nearest, farthest = apart - rn - rl, apart + rn + rl
            nearest = select(nearest > zero, nearest, zero)
            top, bottom = one + half * (high - nearest * nearest), one + half * (low - farthest * farthest)
            slope = rn + size * rl
            top = select(cosine + slope < top, cosine + slope, top) + room_for
            bottom = select(cosine - slope > bottom, cosine - slope, bottom) - room_for
            top, bottom = select(top > zero, top, zero), select(bottom > zero, bottom, zero)
            # fading
            c, l, q = (  # noqa: E741  its name in texts
                entry(w, COLUMNS + WIDTH * at.FADE + k),
                entry(w, COLUMNS + WIDTH * (at.FADE + 1) + k),
                entry(w, COLUMNS + WIDTH * (at.FADE + 2) + k),
            )
            near, far = distance - extent, distance + extent
            bright, dim = one / (c + l * near + q * near * near), one / (c + l * far + q * far * far)
            fades = l + q > zero
            bright, dim = select(fades, bright, c), select(fades, dim, c)
            bright, dim = select(bright < most, bright, most), select(dim < most, dim, most)
            within = far * far * (one + room_for) <= entry(w, COLUMNS + WIDTH * at.REACH + k)
            fine = (extent < distance) & within
            # the pair (R, V) or (N, H), how far each may be off, and |a|^2 - 1
            if halfway:
                hx, hy, hz = x + vx, y + vy, z + vz
                squared = dot(hx, hy, hz, hx, hy, hz)
                inverse = one / np.sqrt(squared)
                off = rn + chord((rl + rv) * inverse)
                dx, dy, dz = nx - hx * inverse, ny - hy * inverse, nz - hz * inverse
                shortest, longest = low, high
            else:
                twice = two * cosine
                off = stretch * rl + two * rn * size + spread + three * rn * rn + rv
                dx, dy, dz = twice * nx - x - vx, twice * ny - y - vy, twice * nz - z - vz
                tops, bottoms = four * top * top, four * bottom * bottom
                shortest = low * select(low < zero, tops, bottoms)
                longest = high * select(high < zero, bottoms, tops)
            apart = np.sqrt(dot(dx, dy, dz, dx, dy, dz))
            off = off + room_for
            nearest, farthest = apart - off, apart + off
            nearest = select(nearest > zero, nearest, zero)
            x_top = one + half * (longest - nearest * nearest) + room_for
            x_bottom = one + half * (shortest - farthest * farthest) - room_for
            above = select(x_bottom > zero, x_bottom, zero)
            if plain:
                brighter, darker = x_top, above
            elif dotted:
                brighter, darker = one - x_top, one - x_bottom
            elif cross:
                brighter = half * (one + shortest - x_top * x_top) - room_for
                darker = half * (one + longest - above * above) + room_for
                brighter = select(brighter > zero, brighter, zero)
                if tangent:
                    brighter = brighter / (x_top * x_top)
                    darker = select(above > tiny, darker / (above * above), most)
                    darker = select(darker < most, darker, most)
            else:
                brighter, darker = half * nearest * nearest - room_for, half * farthest * farthest + room_for
                brighter = select(brighter > zero, brighter, zero)
            tail = entry(w, COLUMNS + WIDTH * at.TAIL + k)
            put(w, DIM + k, bottom * dim)
            put(w, BRIGHT + k, top * bright)
            put(w, FADED + k, dim)
            put(w, FADING + k, bright)
            put(w, AT + k, brighter)
            put(w, AT + WIDTH + k, darker)
            put(w, GATES + k, select((x_top > tail) & (top > zero), x_top, zero))
            put(w, GATES + WIDTH + k, select((x_bottom > tail) & (bottom > zero), x_bottom, zero))
            put(w, LOSS + k, select(fine, zero, endless))

    @jit.inline
    def bounds(w: Any, base: Any) -> None:
        """Half the width of every light's terms, in the channel where it is largest."""
        for j in range(WIDTH):
            k = base + j
            terms = entry(w, BRIGHT + k) - entry(w, DIM + k)
            shine = entry(w, VALUES + k) * entry(w, FADING + k)
            shine -= entry(w, VALUES + WIDTH + k) * entry(w, FADED + k)
            wrong = zero
            for c in range(3):
                mine = entry(w, COLUMNS + WIDTH * (at.DIFFUSE + c) + k) * terms
                mine += entry(w, COLUMNS + WIDTH * (at.SPECULAR + c) + k) * shine
                wrong = select(mine > wrong, mine, wrong)
            wrong = half * wrong * (one + room_for) + entry(w, LOSS + k)
            # what is not a number is not held
            put(w, LOSS + k, select(wrong <= most, wrong, endless))

    @jit.inline
    def folded(sums: Any, row: Any) -> Any:
        """The sum of a row, whose lanes it uses up."""
        for lanes in (16, 8):
            for j in range(lanes):
                i = row * WIDTH + j
                put(sums, i, entry(sums, i) + entry(sums, i + lanes))
        total = zero
        for j in range(8):
            total += entry(sums, row * WIDTH + j)
        return total

    @jit.inline
    def chosen(w: Any, end: Any, sums: Any, budget: Any) -> Any:
        """The largest of some thresholds below which the bounds fit into the budget together; negative if none."""
        threshold, found = budget, -one
        for _ in range(_HALVINGS):
            sums[:WIDTH] = zero
            for base in range(0, end, ROWS):
                for j in range(WIDTH):
                    wrong = entry(w, base + LOSS + j)
                    put(sums, j, entry(sums, j) + select(wrong <= threshold, wrong, zero))
            if folded(sums, 0) <= budget:
                found = threshold
                break
            threshold = half * threshold
        return found

    @jit.inline
    def hold(w: Any, end: Any, sums: Any, threshold: Any, held: Any, bit: Any) -> None:
        """Sum up what the lights below a threshold give, each at the middle of its interval, and mark them."""
        sums[:] = zero
        for base in range(0, end, ROWS):
            first = base // ROWS * WIDTH
            for j in range(WIDTH):
                k = base + j
                wrong = entry(w, LOSS + k)
                mine = wrong <= threshold
                terms = select(mine, half * (entry(w, DIM + k) + entry(w, BRIGHT + k)), zero)
                shine = entry(w, VALUES + k) * entry(w, FADING + k) + entry(w, VALUES + WIDTH + k) * entry(w, FADED + k)
                shine = select(mine, half * shine, zero)
                for c in range(3):
                    light = entry(w, COLUMNS + WIDTH * (at.DIFFUSE + c) + k) * terms
                    light += entry(w, COLUMNS + WIDTH * (at.SPECULAR + c) + k) * shine
                    put(sums, c * WIDTH + j, entry(sums, c * WIDTH + j) + light)
                put(sums, 3 * WIDTH + j, entry(sums, 3 * WIDTH + j) + select(mine, wrong, zero))
                put(sums, 4 * WIDTH + j, entry(sums, 4 * WIDTH + j) + select(mine, one, zero))
            for j in range(WIDTH):
                mine = entry(w, base + LOSS + j) <= threshold
                put(held, first + j, entry(held, first + j) | select(mine, bit, np.int64(0)))

    @jit.inline
    def gathered(lights: Any, verdicts: Any, held: Any, w: Any) -> Any:
        """Columns of the lights that were not judged away, and their names; returns how many there are."""
        n = 0
        for k in range(len(lights)):
            if verdicts[k] == zero:
                base = n // WIDTH * ROWS + n % WIDTH
                for c in range(at.NUMBERS):
                    put(w, base + COLUMNS + WIDTH * c, lights[k, c])
                held[len(lights) + n] = k
                n += 1
        for k in range(n, (n + WIDTH - 1) // WIDTH * WIDTH):  # what reaches nothing is not held
            base = k // WIDTH * ROWS + k % WIDTH + COLUMNS
            for c in range(at.NUMBERS):
                put(w, base + WIDTH * c, zero)
            put(w, base + WIDTH * at.WHERE, one)
            put(w, base + WIDTH * at.FADE, one)
            put(w, base + WIDTH * at.REACH, -one)
        return n

    def patches(
        s: Array,
        lights: Array,
        verdicts: Array,
        visible: Array,
        info: Array,
        held: Array,
        counts: Array,
        lost: Array,
        coefficients: Array,
        table: Array,
        limits: Array,
        work: Array,
    ) -> None:
        count = len(lights)
        names, rows, bits = held[count : 2 * count], held[2 * count : 3 * count], held[3 * count :]
        held[:count] = 0
        n = gathered(lights, verdicts, held, work)
        if n == 0:
            return
        bits[:] = 0
        end = (n + WIDTH - 1) // WIDTH * ROWS
        sums = work[len(work) - SIZE - _SUMS * WIDTH : len(work) - SIZE]
        ball = work[len(work) - SIZE :]
        ball[VIEW], ball[VIEW + 1], ball[VIEW + 2] = lights[0, at.EYE], lights[0, at.EYE + 1], lights[0, at.EYE + 2]
        ball[VIEW + 3] = zero
        for b in range(info[USED]):
            bounding_spheres.fill(s, at.POINT, b, ball, POINT)
            bounding_spheres.fill(s, at.NORMAL, b, ball, NORMAL)
            bounding_spheres.measure_lengths(s, b, ball)
            if info[VIEWS]:
                bounding_spheres.fill(s, at.VIEW, b, ball, VIEW)
            for base in range(0, end, ROWS):
                estimate(ball, work, base)
                coordinate_kernels.values_at(info[FORMULA], s)(
                    work[base + AT : base + AT + 2 * WIDTH],
                    work[base + GATES : base + GATES + 2 * WIDTH],
                    coefficients,
                    table,
                    work[base + VALUES : base + VALUES + 2 * WIDTH],
                )
                bounds(work, base)
            for k in range(n if info[SHADOWS] else 0):
                i = k // WIDTH * ROWS + LOSS + k % WIDTH
                if work[i] <= limits[at.BUDGET] and not _seen(visible, rows[names[k]], info, b):
                    work[i] = endless
            hold(work, end, sums, chosen(work, end, sums, limits[at.BUDGET]), bits, np.int64(1 << b))
            some = int(folded(sums, 4))
            if some:
                counts[at.HELD] += some * min(at.BLOCK, info[INSIDE] - b * at.BLOCK)
                lost[reach_bounds.HOLDING] = max(lost[reach_bounds.HOLDING], folded(sums, 3))
                red, green, blue = folded(sums, 0), folded(sums, 1), folded(sums, 2)
                for j in range(at.BLOCK):
                    i = at.SUM + b * at.BLOCK + j
                    put(s, i, entry(s, i) + red)
                    put(s, i + at.TILE, entry(s, i + at.TILE) + green)
                    put(s, i + 2 * at.TILE, entry(s, i + 2 * at.TILE) + blue)
        for k in range(n):
            held[names[k]] = bits[k]

    return jit.elementwise(patch_signature(precision.carrier), patches)
