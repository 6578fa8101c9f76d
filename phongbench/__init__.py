"""phongbench: which specular-highlight formula to ship, by measured error, run time and stability.

    import phongbench as pb

    pb.specular(a, b, "lyon:cross:8", alpha=50)
    pb.recommend(alpha=50, max_error=1 / 255)

A name is loaded when it is first used: importing the package costs nothing.
"""

from importlib import import_module

TYPE_CHECKING = (
    False  # read as true by type checkers; `typing` has it too, but takes as long to import as all else here
)
if TYPE_CHECKING:
    from phongbench.compiler import elementary
    from phongbench.face.highlight import curve, moments, shader, specular
    from phongbench.face.inverse import inverse_line, inverse_photometric
    from phongbench.face.pictures import Picture, render, shade
    from phongbench.face.run import Run, front, load, recommend, run
    from phongbench.formulas.citations import Source
    from phongbench.formulas.formula import Formula
    from phongbench.formulas.spec import ALPHA, GAMMA, Approximation, Cost
    from phongbench.formulas.user_files import load_file

__version__ = "0.1.0"
#: module -> what it gives to this one
_OFFERED = {
    "compiler": ("elementary",),
    "face.highlight": ("curve", "moments", "shader", "specular"),
    "face.inverse": ("inverse_line", "inverse_photometric"),
    "face.pictures": ("Picture", "render", "shade"),
    "face.run": ("Run", "front", "load", "recommend", "run"),
    "formulas.citations": ("Source",),
    "formulas.formula": ("Formula",),
    "formulas.spec": ("ALPHA", "GAMMA", "Approximation", "Cost"),
    "formulas.user_files": ("load_file",),
}
_HOME = {name: module for module, names in _OFFERED.items() for name in names}
__all__ = [
    "ALPHA", "GAMMA", "Approximation", "Cost", "Formula", "Picture", "Run", "Source", "curve", "elementary", "front",
    "inverse_line", "inverse_photometric", "load", "load_file", "moments", "recommend", "render",
    "run", "shade", "shader", "specular",
]  # fmt: skip


if not TYPE_CHECKING:  # else a checker would believe that any name is here

    def __getattr__(name: str) -> object:
        if name not in _HOME:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        home = import_module(f"{__name__}.{_HOME[name]}")
        value = import_module(f"{home.__name__}.{name}") if hasattr(home, "__path__") else getattr(home, name)
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
