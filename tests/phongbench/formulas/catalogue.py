"""Every formula of the catalogue: each approximation in each form, space, recipe, way with lengths and slope."""

from collections.abc import Iterator
from itertools import product

from phongbench.formulas.formula import Formula, takes
from phongbench.formulas.normalising import NORMALISE
from phongbench.formulas.recipes import PAIR, RECIPES
from phongbench.formulas.registry import REGISTRY


def everything(gamma: int = 8) -> Iterator[Formula]:
    """All of them, with one gamma where they take one; tricks of processors too."""
    for spec in REGISTRY.values():
        pairs = [(space, PAIR) for space in spec.spaces]
        pairs += [(recipe.space, name) for name, recipe in RECIPES.items() if recipe.space in spec.spaces]
        for form, way, (space, recipe), slope in product(spec.lambda_forms, NORMALISE, pairs, spec.slopes):
            if takes(spec, form, way):
                squarings = gamma if spec.uses_gamma else None
                yield Formula.of(spec.name, form, squarings, slope, space, recipe=recipe, normalise=way)
