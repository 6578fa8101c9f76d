"""What a formula of reflectance is: frozen data that shading, studies, documents and tests all read."""

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from phongbench.compiler.lowering import Body
from phongbench.errors import InputError
from phongbench.formulas.citations import Source
from phongbench.formulas.spec import MAX_COEFFICIENTS, Cost, Parameter

F0 = Parameter("f0", "the reflectance at normal incidence", 0.0, 1.0)
F82 = Parameter("f82", "the reflectance where the cosine of incidence is 1/7, at about 82 degrees", 0.0, 1.0)
N = Parameter("n", "the refractive index, of the inside over the outside", 1e-3, 1e3)
K = Parameter("k", "the extinction coefficient", 0.0, 1e3)


@dataclass(frozen=True)
class ReflectanceFormula:
    """One formula: its scalar kernel, what a material gives for it, and what is known about it.

    name          what documents call it: lower case with hyphens
    title         for people
    exact         whether it is the physics, unpolarised light on a smooth surface, or an approximation of it
    formula       in the words of maths: v = V.H, the cosine of incidence
    source        where it comes from
    kernel        the scalar body: `cosine` first, then coefficients by name; see CONTRIBUTING.md for the language
    parameters    what a material gives, each for red, green and blue, with ranges
    coefficients  the parameters of one channel by name -> {argument: value}
    domain        where it is meant to be used, and what goes wrong outside
    cost          work of one channel
    """

    name: str
    title: str
    exact: bool
    formula: str
    source: Source
    kernel: Body
    parameters: tuple[Parameter, ...]
    coefficients: Callable[..., Mapping[str, float]]
    domain: str
    cost: Cost
    arguments: tuple[str, ...] = field(init=False, default=())

    def __post_init__(self) -> None:
        first, *others = inspect.signature(self.kernel).parameters
        if first != "cosine" or len(others) > MAX_COEFFICIENTS:
            what = f"the kernel of {self.name!r} must take cosine, then at most {MAX_COEFFICIENTS} coefficients"
            raise InputError(what, self.kernel.__name__)
        object.__setattr__(self, "arguments", tuple(others))

    @property
    def scalars(self) -> tuple[str, ...]:
        """The kernel's arguments that are numbers given at run time: all but the cosine."""
        return self.arguments
