"""Every part of a report that any process can make by itself; the answers at its top are made of one another."""

from phongbench_reports.figures import FIGURES
from phongbench_reports.figures.pictures import SECTIONS
from phongbench_reports.table import Part
from phongbench_reports.tables.behaviour import hostile, smoothness
from phongbench_reports.tables.claims import claims
from phongbench_reports.tables.devices import devices
from phongbench_reports.tables.mesh_edges import mesh_edges
from phongbench_reports.tables.skipped import skipped
from phongbench_reports.tables.sureness import sureness
from phongbench_reports.tables.verdict import census, formulas, worst

#: figure -> the folded table that follows it
BESIDE = {"meshes": Part("mesh_edges", "How wide edges may be", mesh_edges, True)}
#: the tables after the figures, and those at the end of the page
BEHAVIOUR = (
    Part("census", "Values above 1, negative, not finite", census, True),
    Part("hostile", "Hostile inputs", hostile, True),
    Part("smoothness", "Smoothness of the lobes", smoothness, True),
)
CLAIMS = Part("claims", "The textbook claims", claims)
LAST = (
    Part("skipped", "Skipping what is dark", skipped),
    Part("sureness", "How sure the numbers are", sureness, True),
    Part("devices", "On every device", devices),
    Part("worst", "Worst inputs", worst, True),
    Part("formulas", "The formulas", formulas, True),
)
#: name -> part
ALL = {part.name: part for part in (*SECTIONS, *FIGURES, *BESIDE.values(), *BEHAVIOUR, *LAST, CLAIMS)}
