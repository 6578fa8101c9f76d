"""How well shapes that were learnt give back others, each from one picture: synthetic heads that were held out."""

from functools import cache

from phongbench.inverse import held_out
from phongbench.inverse.shape_model import synthetic_heads
from phongbench_reports.readme.markdown import table

#: heads learnt from and held out, pixels of a side, and components
LEARNT, APART, SIZE, COMPONENTS = 100, 8, 48, 20
_WAYS = {"prior": "with prior", "components": "without", "mean": "mean head"}


@cache
def heads() -> str:
    """A table of the heads held out, and what all of them say."""
    _, rows = held_out.learn_and_try(synthetic_heads(LEARNT + APART, SIZE), COMPONENTS, APART)
    columns = {f"degrees, {words}": f"{way}_degrees" for way, words in _WAYS.items()}
    columns |= {f"depth, {words}": f"{way}_depth_rmse" for way, words in _WAYS.items()}
    lines = [
        [str(k + 1), *(f"{row[name]:.3g}" for name in columns.values())]
        for k, row in enumerate(rows.to_dict("records"))
    ]
    lines.append(["mean", *(f"{rows[name].mean():.3g}" for name in columns.values())])
    model = held_out.MODEL
    note = (
        f"{LEARNT} synthetic heads learnt, {APART} others held out, {SIZE} x {SIZE} pixels, {COMPONENTS} components. "
        f"Each is fitted to one picture by exact Phong, alpha {model.alpha:g}, diffuse {model.diffuse:g}, specular "
        f"{model.specular:g}, noise {held_out.NOISE:g}. Degrees: mean angle between normals; depth: root mean squared "
        f"error of heights as a share of the head's span. With the prior, normals are off by "
        f"{held_out.ratio(rows):.0%} of what the mean head's are."
    )
    return f"{table(['head', *columns], lines, right=range(1, 1 + len(columns)))}\n\n{note}"
