"""Every figure of the report, in page order: one file each, one line each here."""

from phongbench_reports.figures import (
    causes,
    copper,
    cut,
    error_angle,
    error_gamma,
    front,
    ghost,
    heatmap,
    incidence,
    meshes,
    moments,
    precision,
    raw_vectors,
    speed,
    split,
    stability,
    step_costs,
    widths,
)
from phongbench_reports.table import Part

FIGURES = (
    Part("error_angle", "Error against angle", error_angle.draw),
    Part("error_gamma", "Largest error against γ, with the law", error_gamma.draw),
    Part("heatmap", "Largest error over α and γ", heatmap.draw),
    Part("front", "Error against time", front.draw),
    Part("incidence", "Reflectance: error against time", incidence.draw),
    Part("copper", "Copper's colour against incidence", copper.draw),
    Part("stability", "Vectors that are not unit length", stability.draw),
    Part("raw_vectors", "From raw vectors: error against time of whole recipes", raw_vectors.draw),
    Part("step_costs", "What each step costs", step_costs.draw),
    Part("causes", "Why lengths are wrong", causes.draw),
    Part("meshes", "Normals interpolated over a mesh", meshes.draw),
    Part("precision", "Error against precision", precision.draw),
    Part("widths", "The best γ of each precision", widths.draw),
    Part("ghost", "The second highlight of the cross form", ghost.draw),
    Part("cut", "Where the highlight is cut off", cut.draw),
    Part("moments", "What a lobe sends where", moments.draw),
    Part("split", "Where the error comes from", split.draw),
    Part("speed", "Time per element and working set", speed.draw),
)
