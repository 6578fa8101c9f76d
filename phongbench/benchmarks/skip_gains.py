"""What each skip of a scene is worth, measured in one run, interleaved."""

import statistics
from typing import Any

import numpy as np

from phongbench.scenes.render import Rendered, render
from phongbench.scenes.scene import Scene
from phongbench.scenes.skips import variants
from phongbench.support.progress import Progress

#: rounds of all variants, in turn; ratios are taken within a round, so that a slow spell of the machine hits both
ROUNDS = 9
_SILENT = Progress()


def skips(scene: Scene, *, rounds: int = ROUNDS, progress: Progress = _SILENT, **wishes: Any) -> list[dict[str, Any]]:
    """A row for each of `variants`: what it takes, and what it changes in the picture.

    seconds          the least
    ratio            median over the rounds of the time over that of "all"; ratio_low and ratio_high its quartiles
    same_bits        whether the picture is that of "none", bit for bit
    largest_change   against the picture of "none", linear light
    wishes           of `render`: size, depth, ...
    """
    chosen = variants()
    progress.stage(f"skips of {scene.name}", (rounds + 1) * len(chosen))
    seconds: dict[str, list[float]] = {name: [] for name in chosen}
    pictures: dict[str, Any] = {}

    def once(name: str) -> Rendered:
        done = render(scene, skips=chosen[name], **wishes)
        progress.advance()
        return done

    for name in chosen:  # compiles, warms up, and shows what changes
        pictures[name] = once(name).picture
    names = list(chosen)
    for number in range(rounds):
        for name in names[number % len(names) :] + names[: number % len(names)]:
            seconds[name].append(once(name).seconds["total"])
    rows = []
    for name in chosen:
        ratios = [mine / full for mine, full in zip(seconds[name], seconds["all"], strict=True)]
        low, middle, high = quartiles(ratios)
        change = float(np.abs(pictures[name] - pictures["none"]).max())
        rows.append(
            {
                "variant": name,
                "seconds": round(min(seconds[name]), 6),
                "ratio": middle,
                "ratio_low": low,
                "ratio_high": high,
                "same_bits": bool(np.array_equal(pictures[name], pictures["none"])),
                "largest_change": change,
            }
        )
    return rows


def quartiles(values: list[float]) -> tuple[float, float, float]:
    """The quartiles of measured values; of a single one, itself."""
    low, middle, high = statistics.quantiles(values, n=4) if len(values) > 1 else (values[0],) * 3
    return low, middle, high
