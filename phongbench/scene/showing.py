"""What `phongbench render` does: a scene's name and wishes in, a picture and what to tell about it out."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from phongbench.approximations import REGISTRY
from phongbench.errors import InputError
from phongbench.lighting import Skips
from phongbench.progress import Progress
from phongbench.scene import formulas, pictures, race, worth
from phongbench.scene.parts import Mesh, Scene
from phongbench.scene.reading import examples, read_scene, specular_of
from phongbench.scene.rendering import render
from phongbench.scene.thrift import Thrift
from phongbench.spec import Approximation

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
    constant_patches: float | None = None
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
        return Thrift.exact() if self.exact else Thrift(shading=Skips(constant_patches=self.constant_patches))

    def arguments(self) -> dict[str, Any]:
        """Those of `render` that a picture and its measurements share."""
        return {
            "size": self.size, "depth": self.depth, "supersampling": self.supersampling, "shadows": self.shadows,
            "model": self.model, "threads": self.threads, "registry": self.registry,
        }  # fmt: skip


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
    pictures.check_writable(out)
    if wish.compare and out.suffix.lower() != ".png":
        raise InputError("a comparison is three pictures to look at", str(out), "write it as .png")
    specular = None if wish.specular is None else specular_of(wish.specular)
    wishes = {"specular": specular, "thrift": wish.thrift, **wish.arguments()}
    progress.stage(f"prepare {scene.name}", 1)
    preparing = render(scene, **wishes | {"size": _FEW}).seconds["total"]
    progress.advance()
    done = render(scene, progress=progress, **wishes)
    told: dict[str, Any] = {"scene": scene.name, "specular": wish.specular or "phong", "picture": str(out)}
    told |= done.as_dict()
    told["seconds"] = {"preparing": preparing, **told["seconds"]}
    told["mrays_per_second"] = round(done.rays / done.seconds["total"] / 1e6, 3)
    if not wish.compare:
        pictures.save(out, done.picture)
        return told
    exact = render(scene.exact(), thrift=wish.thrift, progress=progress, **wish.arguments())
    told["error"] = pictures.compare(exact.picture, done.picture).as_dict()
    told["amplification"] = pictures.amplification(exact.picture, done.picture)
    pictures.save(out, pictures.triple(exact.picture, done.picture))
    return told


def measure(wish: Wish, progress: Progress = _SILENT) -> dict[str, Any]:
    """What each skip saves in a scene, and our tracer beside a plain one and peers, where those can draw the scene."""
    scene = wish.read()
    told: dict[str, Any] = {"scene": scene.name}
    told["skips"] = worth.skips(scene, progress=progress, **wish.arguments(), **_formula(wish))
    told["tracers"], told["absent"] = [], []
    if not _beyond_the_plain(scene):
        told["tracers"], told["absent"] = race.tracers(scene, progress=progress, **wish.arguments())
    return told


def judge(wish: Wish, progress: Progress = _SILENT) -> dict[str, Any]:
    """Every usual and own formula's picture beside that of exact Phong, or that of the one formula asked for."""
    scene = wish.read()
    usual = (*formulas.USUAL, *formulas.own(wish.registry))
    asked = usual if wish.specular is None else (specular_of(wish.specular),)
    arguments = {name: value for name, value in wish.arguments().items() if name != "model"}
    rows = formulas.compare(scene, asked, progress=progress, **arguments)
    drawn = [{k: v for k, v in row.items() if k != "left_out"} for row in rows if not row["left_out"]]
    if wish.specular is not None and not drawn:
        raise InputError(rows[0]["left_out"], None, "ask for another formula, or leave --specular away")
    left_out = [{"formula": formulas.name_of(row), "why": row["left_out"]} for row in rows if row["left_out"]]
    return {"scene": scene.name, "formulas": drawn, "left_out": left_out}


def _formula(wish: Wish) -> dict[str, Any]:
    return {} if wish.specular is None else {"specular": specular_of(wish.specular)}


def _beyond_the_plain(scene: Scene) -> bool:
    """The plain tracer and the peers know neither meshes nor other formulas."""
    return bool(scene.of(Mesh)) or any(m.specular is not None for m in scene.materials)
