"""What `phongbench render` does: a scene's name and options in, a picture and the facts about it out."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from phongbench.errors import InputError
from phongbench.formulas.formula import Formula
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import Approximation
from phongbench.scenes import images, triples
from phongbench.scenes.render import TileEngine, render
from phongbench.scenes.scene import Scene
from phongbench.scenes.scene_files import examples, read_scene
from phongbench.scenes.skips import SceneSkips
from phongbench.shading.specular_term import EXACT
from phongbench.support import image_files
from phongbench.support.progress import Progress

_SILENT = Progress()
#: width and height of the picture that prepares another
_FEW = (32, 18)


@dataclass(frozen=True)
class RenderOptions:
    """The options of a picture; None takes the scene's own, or what is usual.

    registry  the approximations that it may name, the user's own among them
    engine    draws the tiles, elsewhere; without one this process does
    """

    scene: str
    out: Path | None = None
    size: tuple[int, int] | None = None
    specular: str | None = None
    model: str = "phong"
    depth: int | None = None
    supersampling: int | None = None
    shadows: bool | None = None
    skip: bool = True
    exact: bool = False
    compare: bool = False
    threads: int | None = None
    registry: Mapping[str, Approximation] = field(default_factory=lambda: REGISTRY)
    engine: TileEngine | None = None

    def read(self) -> Scene:
        """The scene."""
        return read_scene(self.scene, self.registry)

    @property
    def skips(self) -> SceneSkips:
        """What may be left out."""
        if not self.skip:
            return SceneSkips.none()
        return SceneSkips.exact() if self.exact else SceneSkips()

    @property
    def formula(self) -> Formula | None:
        """That of the specular term; UnknownNameError or InputError for a spelling that is none."""
        return None if self.specular is None else Formula.parse(self.specular, self.registry)

    def arguments(self) -> dict[str, Any]:
        """Those of `render` that a picture and its measurements share."""
        return {
            "size": self.size,
            "depth": self.depth,
            "supersampling": self.supersampling,
            "shadows": self.shadows,
            "model": self.model,
            "threads": self.threads,
            "registry": self.registry,
        }


def listed() -> list[dict[str, str]]:
    """The shipped scenes and what each shows."""
    return [{"scene": name, "shows": facts} for name, facts in examples().items()]


def draw(options: RenderOptions, progress: Progress = _SILENT) -> dict[str, Any]:
    """Draw and write a picture; the facts: where it is, what it took, what was left out, and its error if compared.

    A picture of a few pixels comes first: it builds the geometry and compiles or loads the kernels, so that the time of
    the picture is its own.

    Raises InputError for what cannot be drawn, StorageError if it cannot be written.
    """
    scene = options.read()
    out = options.out or Path(f"{scene.name}.png")
    image_files.check_writable(out)
    if options.compare and out.suffix.lower() != ".png":
        raise InputError("a comparison is three pictures to look at", str(out), "write it as .png")
    formula = options.formula
    arguments = {"specular": formula, "skips": options.skips, **options.arguments()}
    progress.stage(f"prepare {scene.name}", 1)
    preparing = render(scene, **arguments | {"size": _FEW}).seconds["total"]
    progress.advance()
    done = render(scene, progress=progress, engine=options.engine, **arguments)
    facts: dict[str, Any] = {
        "scene": scene.name,
        "specular": (formula or EXACT).spelled(options.registry),
        "picture": str(out),
    }
    facts |= {"notes": list(scene.notes), **done.as_dict()}
    facts["seconds"] = {"preparing": preparing, **facts["seconds"]}
    facts["mrays_per_second"] = round(done.rays / done.seconds["total"] / 1e6, 3)
    if not options.compare:
        image_files.save(out, done.picture)
        return facts
    exact = render(scene.exact(), skips=options.skips, progress=progress, engine=options.engine, **options.arguments())
    facts["error"] = images.compare(exact.picture, done.picture).as_dict()
    names = triples.names(scene, formula or EXACT, options.model, options.registry)
    image_files.save(out, triples.triple(exact.picture, done.picture, names))
    return facts
