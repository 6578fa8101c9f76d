"""The columns of a run's tables, and what they mean."""

BASELINE, TWIN, LIBM = "phong", "aa-twin", "phong-libm"
COPY, TRIAD, DOT, FMA = "copy", "triad", "dot", "fma"
#: rows that are not formulas: what the machine can do at best, and the baseline again under another name
CEILINGS = (COPY, TRIAD, DOT, FMA)


CELL_COLUMNS = (
    "approximation", "lambda_form", "space", "beta_policy", "alpha", "gamma", "beta", "precision", "gated",
)  # fmt: skip
ACCURACY_COLUMNS = (
    *CELL_COLUMNS, "stratum", "perturbation", "length_error", "truth", "samples", "max_abs", "mean_abs", "rms", "bias",
    "p50_abs", "p99_abs", "p999_abs", "max_above", "max_below", "codes_8bit", "model_max", "length_max", "rounding_max",
    "coverage", "nonfinite", "above_one", "negative", "excluded",
)  # fmt: skip
#: what identifies a row of accuracy.parquet; where only the coverage differs, `results.strongest` chooses
ACCURACY_KEY = (
    *(c for c in CELL_COLUMNS if c != "beta"), "stratum", "perturbation", "length_error", "truth", "coverage",
)  # fmt: skip
TIMING_COLUMNS = (
    "approximation", "lambda_form", "space", "beta_policy", "gamma", "precision", "working_set", "elements", "threads",
    "ns_min", "ns_median", "ratio", "ratio_low", "ratio_high", "verdict", "dot_ratio", "bandwidth_fraction", "rounds",
    "contaminated",
)  # fmt: skip
WORST_COLUMNS = (
    *CELL_COLUMNS, "stratum", "perturbation", "length_error", "truth", "coverage", "rank", "error", "exact", "value",
    "ax", "ay", "az", "bx", "by", "bz",
)  # fmt: skip
#: errors of a formula on interpolated normals. mesh: icosphere, torus, uv-sphere or a file's name; edge_degrees: widest
#: angle between the normals at the ends of an edge, of these triangles; left_out: degenerate triangles of the file;
#: normals: raw or renormalised; pair: classic 2(L.N)N-L, lengthwise 2(N.L)N-(N.N)L, half (N, H); truth: interpolated
#: (exact Phong of the interpolated normal made unit) or surface (of the true surface's normal); length_max: largest
#: change from the normals not being unit, and for truth surface from not being the surface's
MESH_COLUMNS = (
    "mesh", "edge_degrees", "triangles", "left_out", "normals", "pair", *CELL_COLUMNS, "truth", "samples", "max_abs",
    "mean_abs", "rms", "codes_8bit", "model_max", "length_max", "nonfinite", "above_one",
)  # fmt: skip
#: what a cell makes of one hostile input. outcome: value, saturates, nan, infinite, above-one, negative,
#: refused; alpha and beta are those of the case
BEHAVIOUR_COLUMNS = (*CELL_COLUMNS, "case", "outcome", "lowest", "highest", "exact")
#: shape of the lobe over all angles. rises: places where it grows away from its peak; largest_rise: how far above what
#: it was nearer to the peak; kink: second difference over the squared step at the lobe's end, over the largest of exact
#: Phong's; missing where no end is
#: overflows: samples whose lambda (or cosine) or value is infinite or at the end of fixed point; subnormals: likewise
SMOOTHNESS_COLUMNS = (
    *CELL_COLUMNS, "samples", "rises", "largest_rise", "kink", "kink_degrees", "overflows", "subnormals",
)  # fmt: skip
#: a picture of a scene by a formula against that of exact Phong: the fields of scene.pictures.PictureError; lobe_max: a
#: bound on a colour's error by the lobe's own largest error, the lights and the materials; left_out: why a formula does
#: not fit the scene, in which case there are no numbers
SCENE_COLUMNS = (
    "scene", "width", "height", "depth", "approximation", "lambda_form", "beta_policy", "gamma", "max_abs", "mean_abs",
    "rms", "psnr", "max_codes", "visible", "flip", "energy", "highlight_area", "lobe_max", "left_out",
)  # fmt: skip
#: what a picture did not need, a line of the ledger each, and how leaving it out changes the picture. setting: the
#: contribution below which reflections stop, of name "cutoff", where `of` and `skipped` are all rays and those saved;
#: same_bits, largest_change: against the picture without this skip alone; bound: what largest_change may be
SKIP_COLUMNS = (
    "scene", "width", "height", "depth", "name", "setting", "kind", "unit", "of", "skipped", "bound", "same_bits",
    "largest_change",
)  # fmt: skip
#: times in scenes, interleaved. kind: formula (name over exact Phong), skip (the picture without it over the one with
#: all), cutoff (reflections stopped over all followed), shading (a surface by the model `name` over Phong's, scene
#: being infinity or near, and setting the exponent); formula: of the specular term; elements: pixels or points;
#: ratio_low and ratio_high: 99 % sign-test interval over the rounds
SCENE_TIME_COLUMNS = (
    "scene", "kind", "name", "formula", "setting", "against", "elements", "depth", "rounds", "seconds", "ratio",
    "ratio_low", "ratio_high",
)  # fmt: skip
#: what holding L, V or both constant over a square polygon changes, as at its middle. distance: of light and viewer, in
#: polygon sides; max_abs: over points and placements, of a full-strength term; incidence_degrees and offset_degrees: of
#: the worst placement, the light's from the normal and the viewer's from the mirrored light
FAR_COLUMNS = (
    "held", "term", "alpha", "distance", "placements", "samples", "max_abs", "incidence_degrees", "offset_degrees",
)  # fmt: skip
#: the columns of every table
COLUMNS = {
    "accuracy": ACCURACY_COLUMNS,
    "timing": TIMING_COLUMNS,
    "worst": WORST_COLUMNS,
    "meshes": MESH_COLUMNS,
    "behaviour": BEHAVIOUR_COLUMNS,
    "smoothness": SMOOTHNESS_COLUMNS,
    "scenes": SCENE_COLUMNS,
    "skips": SKIP_COLUMNS,
    "scene_times": SCENE_TIME_COLUMNS,
    "far": FAR_COLUMNS,
}
