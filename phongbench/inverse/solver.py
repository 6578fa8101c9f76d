"""The compiled solver of photometric stereo: Gauss-Newton steps, damped where they fail, for each pixel by itself.

A pixel's unknowns are two turns of its normal, in the plane across it, and as far as they are asked for the factors of
its diffuse and its specular term. The formula of the highlight is a compiled loop that is called at its address, so
nothing is compiled again for another one. Its derivative is a difference quotient: steps need no more.

Source  Levenberg 1944 and Marquardt 1963 for the damping, quoted from memory
"""

import math
from typing import Any

import numpy as np

from phongbench.compiler import jit
from phongbench.compiler.precisions import Array
from phongbench.formulas import coordinate_kernels

_values_at = coordinate_kernels.values_at

#: columns of a light: its direction, the half vector between it and the viewer, its intensity
LIGHT, HALF, STRENGTH, OF_LIGHT = 0, 3, 6, 7
#: numbers of a model: terms, space (1: half) and form of the formula, what is solved for, and when to stop
AMBIENT, DIFFUSE, SPECULAR, IS_HALF, FORM, FITS_DIFFUSE, FITS_SPECULAR, MOST, ENOUGH, NUMBERS = range(10)
#: lambda forms as numbers; those that are equal on unit vectors share one
FORMS = {"none": 0, "dot": 1, "difference": 1, "cross": 2, "tan2": 3}
#: columns of an answer: the normal, the factors of both terms, root of the mean squared difference, steps
NORMAL, OF_DIFFUSE, OF_SPECULAR, RESIDUAL, STEPS, ANSWERS = 0, 3, 4, 5, 6, 7
#: step of the difference quotient over the cosine
_STEP = 1e-7
#: damping at the start, its bounds, and how it falls and grows
_DAMPING, _LEAST, _LARGEST, _FALL, _GROWTH = 1e-3, 1e-12, 1e8, 0.1, 10.0


@jit.inline
def _coordinate(x: Any, form: Any) -> Any:
    """What the formula takes, of unit vectors whose angle has the cosine x."""
    if form == 0:
        return x
    if form == 1:
        return 1.0 - x
    if form == 2:
        return 0.5 * (1.0 - x * x)
    return 0.5 * (1.0 - x * x) / (x * x) if x != 0.0 else math.inf


@jit.inline
def _highlights(address: Any, lights: Any, state: Any, model: Any, kernel: Any, room: Any) -> None:
    """The formula at the cosine of each light, and a step before it: room[2] holds (value, value before) in turn."""
    count, form = len(lights), int(model[FORM])
    for j in range(count):
        one = lights[j]
        facing = one[0] * state[0] + one[1] * state[1] + one[2] * state[2]
        if model[IS_HALF] > 0.0:
            x = one[3] * state[0] + one[4] * state[1] + one[5] * state[2]
        else:
            x = 2.0 * facing * state[2] - one[2]
        room[0, 2 * j], room[0, 2 * j + 1] = _coordinate(x, form), _coordinate(x - _STEP, form)
        lit = x if facing > 0.0 else 0.0
        room[1, 2 * j], room[1, 2 * j + 1] = lit, lit
    _values_at(address, room)(room[0], room[1], kernel[0], kernel[1], room[2])


@jit.inline
def _equations(observed: Any, used: Any, lights: Any, state: Any, model: Any, room: Any, equations: Any) -> Any:
    """The normal equations of a step: rows 0 to 3 the matrix, row 4 the right side; returns the sum of squares."""
    total, nx, ny, nz = 0.0, state[0], state[1], state[2]
    # two directions across the normal (Duff and others 2017)
    sign = 1.0 if nz >= 0.0 else -1.0
    a = -1.0 / (sign + nz)
    b = nx * ny * a
    px, py, pz = 1.0 + sign * nx * nx * a, sign * b, -sign * nx
    qx, qy, qz = b, sign + ny * ny * a, -ny
    equations[:] = 0.0
    row = room[3]
    for j in range(len(lights)):
        if used[j] == 0:
            continue
        one = lights[j]
        facing = one[0] * nx + one[1] * ny + one[2] * nz
        lit = facing if facing > 0.0 else 0.0
        highlight = room[2, 2 * j]
        gap = observed[j] - model[AMBIENT]
        gap -= one[STRENGTH] * (model[DIFFUSE] * state[3] * lit + model[SPECULAR] * state[4] * highlight)
        total += gap * gap
        if facing <= 0.0:
            continue
        slope = model[SPECULAR] * state[4] * (highlight - room[2, 2 * j + 1]) / _STEP
        flat = model[DIFFUSE] * state[3]
        if model[IS_HALF] > 0.0:
            gx, gy, gz = flat * one[0] + slope * one[3], flat * one[1] + slope * one[4], flat * one[2] + slope * one[5]
        else:
            bend = flat + 2.0 * slope * nz
            gx, gy, gz = bend * one[0], bend * one[1], bend * one[2] + 2.0 * slope * facing
        row[0] = one[STRENGTH] * (gx * px + gy * py + gz * pz)
        row[1] = one[STRENGTH] * (gx * qx + gy * qy + gz * qz)
        row[2] = one[STRENGTH] * model[DIFFUSE] * lit if model[FITS_DIFFUSE] > 0.0 else 0.0
        row[3] = one[STRENGTH] * model[SPECULAR] * highlight if model[FITS_SPECULAR] > 0.0 else 0.0
        for r in range(4):
            equations[4, r] += row[r] * gap
            for c in range(r + 1):
                equations[r, c] += row[r] * row[c]
    return total


@jit.inline
def _solved(equations: Any, damping: Any, lower: Any, step: Any) -> None:
    """The step of the damped equations, by Cholesky's decomposition; unknowns that nothing depends on stay."""
    size = equations[0, 0] + equations[1, 1] + equations[2, 2] + equations[3, 3]
    for r in range(4):
        for c in range(r + 1):
            value = equations[r, c]
            if r == c:
                value += damping * (size if size > 0.0 else 1.0)
            for m in range(c):
                value -= lower[r, m] * lower[c, m]
            if r == c:
                lower[r, r] = math.sqrt(value) if value > 0.0 else 1.0
            else:
                lower[r, c] = value / lower[c, c]
    for r in range(4):
        value = equations[4, r]
        for m in range(r):
            value -= lower[r, m] * step[m]
        step[r] = value / lower[r, r]
    for back in range(4):
        r = 3 - back
        value = step[r]
        for m in range(r + 1, 4):
            value -= lower[m, r] * step[m]
        step[r] = value / lower[r, r]


@jit.inline
def _moved(best: Any, step: Any, state: Any) -> None:
    """The state a step away from the best one; the normal keeps length 1, factors stay positive."""
    nx, ny, nz = best[0], best[1], best[2]
    sign = 1.0 if nz >= 0.0 else -1.0
    a = -1.0 / (sign + nz)
    b = nx * ny * a
    # no step turns by more than 45 degrees
    turn = math.sqrt(step[0] * step[0] + step[1] * step[1])
    share = 1.0 / turn if turn > 1.0 else 1.0
    u, v = share * step[0], share * step[1]
    x = nx + u * (1.0 + sign * nx * nx * a) + v * b
    y = ny + u * sign * b + v * (sign + ny * ny * a)
    z = nz - u * sign * nx - v * ny
    length = math.sqrt(x * x + y * y + z * z)
    state[0], state[1], state[2] = x / length, y / length, z / length
    for i in range(2):
        moved = best[3 + i] + step[2 + i]
        state[3 + i] = moved if moved > 0.0 else 0.5 * best[3 + i]


@jit.driver
def solve_pixels(
    address: int, observed: Array, used: Array, lights: Array, model: Array, kernel: Any, found: Array
) -> None:
    """Improve the normals of pixels, in place.

    address   of the formula's loop from coordinates to values
    observed  (n, k)         intensities
    used      (n, k) uint8   0 where one is left out
    lights    (k, OF_LIGHT)
    model     NUMBERS
    kernel    the coefficients and the table of the loop
    found     (n, ANSWERS)   in: where to start; pixels whose normal is NaN are left alone
    """
    count = len(lights)
    room = np.zeros((4, max(2 * count, 4)))
    equations, held, lower = np.zeros((5, 4)), np.zeros((5, 4)), np.zeros((4, 4))
    step, state = np.zeros(4), np.zeros(5)
    for i in range(len(observed)):
        best = found[i, :5]
        if best[0] != best[0]:
            continue
        samples = 0
        for j in range(count):
            samples += used[i, j]
        state[:] = best
        damping, least, taken = _DAMPING, math.inf, 0
        while taken < model[MOST]:
            _highlights(address, lights, state, model, kernel, room)
            total = _equations(observed[i], used[i], lights, state, model, room, equations)
            taken += 1
            if total < least:
                done = least - total <= model[ENOUGH] * least if least < math.inf else total == 0.0
                least = total
                best[:] = state
                held[:] = equations
                damping = max(damping * _FALL, _LEAST)
                if done:
                    break
            else:
                damping *= _GROWTH
                if damping > _LARGEST:
                    break
            _solved(held, damping, lower, step)
            if step[0] * step[0] + step[1] * step[1] + step[2] * step[2] + step[3] * step[3] < model[ENOUGH] ** 2:
                break
            _moved(best, step, state)
        found[i, RESIDUAL] = math.sqrt(least / samples) if samples > 0 else math.nan
        found[i, STEPS] = taken
