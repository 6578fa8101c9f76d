"""Programs in which a formula is counted: it is unrolled by hand over vectors that change, and added up as lights are.

What a formula costs is the difference to the same program with a bare dot product in its place. So a formula that ends
in a product shares its last step with the sum, as it does in a shader that adds lights up.
"""

from phongbench.formulas.shader_code.language import Language

#: calls of a program, and of one with a table, which compilers copy for each call
UNROLLED, WITH_TABLE = 32, 8
#: names of the directions that a program holds, in the order in which `highlight` takes them
NAMES = ("a", "b", "c")
#: variables that the multiply-adds around a call work on: enough that none waits for another
_AROUND = 4


def factors(step: int, numbers: Language) -> tuple[str, ...]:
    """Constants of a step, different ones in each, so that no two steps are the same."""
    return tuple(numbers.number(1.25 + (len(NAMES) * step + i) / 256) for i in range(len(NAMES)))


def steps(calls: int, vectors: int, context: int, moved: str, numbers: Language) -> list[str]:
    """The statements between reading the vectors and writing the result, in the words that C and GLSL share.

    calls    of `highlight`
    vectors  directions that it takes, 2 or 3
    context  multiply-adds around each call
    moved    the statement that makes a new vector: to be filled with its name, twice, a factor and another vector
    numbers  the language in the precision of total and factors
    """
    names, kind = NAMES[:vectors], numbers.float_type
    done = [f"{kind} total = {numbers.number(0.0)};"]
    around = [f"t{i}" for i in range(_AROUND)] if context else []
    done += [f"{kind} {name} = {names[i % vectors]}.{'xyz'[i % 3]};" for i, name in enumerate(around)]
    for step in range(calls):
        done += [
            moved.format(name, name, factor, names[(i + 1) % vectors])
            for i, (name, factor) in enumerate(zip(names, factors(step, numbers), strict=False))
        ]
        done.append(f"total += highlight({', '.join(names)});")
        for i in range(context):
            t, u, v = (f"t{(i + k) % _AROUND}" for k in range(3))
            done.append(f"{t} = {t} * {u} + {v};")
    kept = [f"{name}.{axis}" for name in names for axis in "xyz"] + around
    return [*done, f"total += {' + '.join(kept)};"]


def indented(statements: list[str], depth: int = 1) -> str:
    """The statements, one a line."""
    return "\n".join("    " * depth + statement for statement in statements)
