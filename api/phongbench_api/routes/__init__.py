"""Every family of routes, in the order of the documentation: one module each, one name here."""

from phongbench_api.routes import (
    answers,
    curve,
    files,
    formulas,
    guide,
    health,
    inverse,
    measured,
    pages,
    render,
    runs,
    shade,
    shader,
    specular,
    targets,
)

ROUTERS = (
    health.router, formulas.router, targets.router, specular.router, shade.router, render.router, curve.router,
    shader.router, inverse.router, answers.router, measured.router, runs.router, files.router, pages.router,
    guide.router,
)  # fmt: skip
