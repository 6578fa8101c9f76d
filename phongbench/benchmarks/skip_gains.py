"""What each skip of a scene is worth, measured in one run, interleaved."""

from collections.abc import Callable
from typing import Any

import numpy as np

from phongbench.compiler.precisions import Array
from phongbench.scenes.render import render
from phongbench.scenes.scene import Scene
from phongbench.scenes.skips import variants
from phongbench.support.progress import Progress
from phongbench.timing.interleaved import interleaved
from phongbench.timing.statistics import MIN_ROUNDS

_SILENT = Progress()


def skips(
    scene: Scene, *, rounds: int = MIN_ROUNDS, progress: Progress = _SILENT, **options: Any
) -> list[dict[str, Any]]:
    """A row for each of `variants`: what it takes, and what it changes in the picture.

    options  of `render`: size, depth, ...
    returns  rows of variant; rounds, seconds, ratio, ratio_low and ratio_high over "all", see `Times.row`; same_bits,
             whether the picture is that of "none", bit for bit; largest_change, against that of "none", linear light
    """
    chosen = variants()
    pictures: dict[str, Array] = {}

    def drawing(name: str) -> Callable[[], float]:
        def draw() -> float:
            done = render(scene, skips=chosen[name], **options)
            pictures[name] = done.picture
            return float(done.seconds["total"])

        return draw

    progress.stage(f"skips of {scene.name}", (rounds + 1) * len(chosen))
    times = interleaved({name: drawing(name) for name in chosen}, rounds=rounds, warm=1, step=progress.advance)
    whole = pictures["none"]
    return [
        {
            "variant": name,
            **times.row(name, "all"),
            "same_bits": bool(np.array_equal(picture, whole)),
            "largest_change": float(np.abs(picture - whole).max()),
        }
        for name, picture in pictures.items()
    ]
