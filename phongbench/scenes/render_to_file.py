"""What `phongbench render` does: a scene's name and wishes in, a picture and what to tell about it out."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from phongbench.errors import InputError
from phongbench.formulas.formula import specular_of
from phongbench.formulas.registry import REGISTRY
from phongbench.formulas.spec import Approximation
from phongbench.scenes import images
from phongbench.scenes.render import render
from phongbench.scenes.scene import Scene
from phongbench.scenes.scene_files import examples, read_scene
from phongbench.scenes.skips import Thrift
from phongbench.support.progress import Progress

_SILENT = Progress()
#: width and height of the picture that prepares another
_FEW = (32, 18)


@dataclass(frozen=True)
class Wish:
    """What a user asks for; None takes the scene's own, or what is usual.

    registry  the approximations that it may name, the user's own among them
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

    def read(self) -> Scene:
        """The scene."""
        return read_scene(self.scene, self.registry)

    @property
    def thrift(self) -> Thrift:
        """What may be left out."""
        if not self.skip:
            return Thrift.none()
        return Thrift.exact() if self.exact else Thrift()

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
    return [{"scene": name, "shows": told} for name, told in examples().items()]


def draw(wish: Wish, progress: Progress = _SILENT) -> dict[str, Any]:
    """Draw and write a picture; what to tell: where it is, what it took, what was left out, and its error if asked.

    A picture of a few pixels comes first: it builds the geometry and compiles or loads the kernels, so that the time of
    the picture is its own.

    Raises InputError for what cannot be drawn, StorageError if it cannot be written.
    """
    scene = wish.read()
    out = wish.out or Path(f"{scene.name}.png")
    images.check_writable(out)
    if wish.compare and out.suffix.lower() != ".png":
        raise InputError("a comparison is three pictures to look at", str(out), "write it as .png")
    specular = None if wish.specular is None else specular_of(wish.specular)
    wishes = {"specular": specular, "thrift": wish.thrift, **wish.arguments()}
    progress.stage(f"prepare {scene.name}", 1)
    preparing = render(scene, **wishes | {"size": _FEW}).seconds["total"]
    progress.advance()
    done = render(scene, progress=progress, **wishes)
    told: dict[str, Any] = {"scene": scene.name, "specular": wish.specular or "phong", "picture": str(out)}
    told |= {"notes": list(scene.notes), **done.as_dict()}
    told["seconds"] = {"preparing": preparing, **told["seconds"]}
    told["mrays_per_second"] = round(done.rays / done.seconds["total"] / 1e6, 3)
    if not wish.compare:
        images.save(out, done.picture)
        return told
    exact = render(scene.exact(), thrift=wish.thrift, progress=progress, **wish.arguments())
    told["error"] = images.compare(exact.picture, done.picture).as_dict()
    told["amplification"] = images.amplification(exact.picture, done.picture)
    images.save(out, images.triple(exact.picture, done.picture))
    return told
