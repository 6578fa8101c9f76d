"""What a scene is made of: frozen data, checked where it is read, the same for every renderer."""

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field, replace
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from phongbench.formulas.formula import Formula
from phongbench.shading.lighting import Light, Material
from phongbench.support.documents import Vector

#: pixels of a picture, samples of a pixel's side, reflections in a row, and what a scene may hold
MOST_PIXELS, MOST_SUPERSAMPLING, MOST_DEPTH = 1 << 25, 8, 64
MOST_LIGHTS, MOST_OBJECTS, MOST_TRIANGLES = 1024, 4096, 4_000_000
#: shortest radius, side, reach and view of a document, the longest being its inverse: nothing else knows a size
SHORTEST = 1e-9


@dataclass(frozen=True, slots=True)
class Camera:
    """A pinhole.

    position       where it is
    target         what it looks at
    up             what is up in the picture; not along the view
    field_of_view  degrees from the lower to the upper edge, between 1 and 170
    """

    position: Vector
    target: Vector
    up: Vector = (0.0, 1.0, 0.0)
    field_of_view: float = 45.0


@dataclass(frozen=True, slots=True)
class SurfaceMaterial:
    """What a surface does to light, and to the ray that found it.

    name          str              as the document calls it
    reflection    Material         of the shading library: colours, shininess, reflectance against incidence
    reflectivity  float in 0 .. 1  k: the colour is (1 - k) direct + k reflected light, at every incidence: `fresnel` is
                                   of highlights
    specular      Formula | None   formula of the specular term; None takes the picture's
    """

    name: str
    reflection: Material
    reflectivity: float = 0.0
    specular: Formula | None = None


@dataclass(frozen=True, slots=True)
class Chequerboard:
    """A pattern of two materials, given by their index in the scene, on squares with a side of `side`."""

    even: int
    odd: int
    side: float


@dataclass(frozen=True, slots=True)
class Sphere:
    """A sphere; `material` is an index into the scene's materials, as below."""

    centre: Vector
    radius: float
    material: int


@dataclass(frozen=True, slots=True)
class Plane:
    """An endless plane through `point`, seen from both sides; the pattern's squares start at the point.

    normal   unit vector
    pattern  a chequerboard instead of the one material, or None
    """

    point: Vector
    normal: Vector
    material: int
    pattern: Chequerboard | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """Triangles in world coordinates.

    vertices   float64 (n, 3)
    faces      int32 (m, 3)  indices of vertices
    normals    float64 (n, 3)  unit, at the vertices
    materials  int32 (m,)  a material for each face
    unit       bool  whether interpolated normals are scaled to length 1 again
    smooth     "normals": Phong shading; "colours": Gouraud shading, which lights the vertices, see vertices.py;
               "none": flat faces
    notes      sentences on what its files hold that is changed or not drawn
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    normals: NDArray[np.float64]
    materials: NDArray[np.int32]
    unit: bool = True
    smooth: str = "normals"
    notes: tuple[str, ...] = ()


Object = Sphere | Plane | Mesh


@dataclass(frozen=True, slots=True)
class Picture:
    """How a scene wants to be drawn, where nobody says otherwise.

    size           pixels, width and height
    depth          reflections in a row that are followed: 0 shows direct light only
    supersampling  samples along a pixel's side
    shadows        whether an object keeps a light from another
    """

    size: tuple[int, int] = (640, 360)
    depth: int = 3
    supersampling: int = 1
    shadows: bool = False


class SceneCache:
    """What was computed from a scene's objects, the latest thing of each kind: it lives as long as the scenes do.

    Scenes that `replace` makes of one another share it while their objects are the same, so that a picture in another
    size, or of other materials, does not build them anew.
    """

    __slots__ = ("_lock", "_things", "objects")

    def __init__(self, objects: tuple[Object, ...]) -> None:
        self.objects = objects
        self._lock, self._things = Lock(), {}  # type: tuple[Lock, dict[str, tuple[Hashable, Any]]]

    def __reduce__(self) -> tuple[type["SceneCache"], tuple[tuple[Object, ...]]]:
        """For another process, which computes its own: trees and locks do not travel."""
        return SceneCache, (self.objects,)

    def of(self, kind: str, key: Hashable, make: Callable[[], Any]) -> Any:
        """The thing of this kind, made if there is none for this key; who asks meanwhile waits, and makes no second.

        key  what it depends on besides the objects
        """
        with self._lock:
            if kind not in self._things or self._things[kind][0] != key:
                self._things[kind] = key, make()
            return self._things[kind][1]


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """Everything a renderer needs to know.

    name           str  of the file, without its ending
    ambient_light  colour that reaches every surface
    background     colour of what no ray hits
    cache          what was computed from the objects; nobody but `replace` gives it
    """

    name: str
    camera: Camera
    materials: tuple[SurfaceMaterial, ...]
    objects: tuple[Object, ...]
    lights: tuple[Light, ...]
    ambient_light: Vector = (0.1, 0.1, 0.1)
    background: Vector = (0.0, 0.0, 0.0)
    picture: Picture = field(default_factory=Picture)
    cache: SceneCache = field(default_factory=lambda: SceneCache(()), repr=False)

    def __post_init__(self) -> None:
        if self.cache.objects is not self.objects:
            object.__setattr__(self, "cache", SceneCache(self.objects))

    def exact(self) -> "Scene":
        """The scene with exact Phong for every material, whatever formula it names."""
        return replace(self, materials=tuple(replace(material, specular=None) for material in self.materials))

    def of(self, kind: type[Any]) -> list[Any]:
        """The objects of one kind, in their order."""
        return [thing for thing in self.objects if isinstance(thing, kind)]

    @property
    def notes(self) -> tuple[str, ...]:
        """What the files of its meshes hold that is changed or not drawn, each once."""
        return tuple(dict.fromkeys(note for mesh in self.of(Mesh) for note in mesh.notes))
