"""What a run's tables hold: every column with its type, unit and meaning, and which columns identify a row.

Units: "1" is the scale of highlight factors and colours, which lie in 0..1; "codes" are steps of an 8-bit channel.
"""

from collections.abc import Mapping
from dataclasses import replace

from phongbench.results import formula_columns
from phongbench.results.columns import Column, Table
from phongbench.results.columns import key_column as _key
from phongbench.results.columns import table as _table
from phongbench.results.cost_table import COSTS
from phongbench.results.emitted_table import EMITTED
from phongbench.results.formula_columns import BY_NAME as _BY_NAME
from phongbench.results.formula_columns import CELL_COLUMNS as _CELL
from phongbench.results.formula_columns import FORMULA as _FORMULA
from phongbench.results.formula_columns import RATIO as _RATIO
from phongbench.results.inverse_table import INVERSE

BASELINE, TWIN, LIBM, DISTANT = "phong", "aa-twin", "phong-libm", "far-"  # the last before a name: L and V at infinity
#: timing rows that are no formulas: what the machine can do at best
CEILINGS = COPY, TRIAD, DOT, FMA = "copy", "triad", "dot", "fma"
#: rows of times that are no formulas of the registry
NO_FORMULAS = (TWIN, LIBM, *CEILINGS)
#: how a largest error was found, the weaker first: in samples, by a search, over every input, bounded by a proof, or
#: bounded for every device that keeps the accuracies of WGSL and Vulkan
COVERAGES = ("sampled", "searched", "exhaustive", "certified", "contract")
#: devices that compute: this machine's processor, and an adapter of WebGPU
CPU, GPU = "cpu", "gpu"
#: what stands for the precision of certified rows: the formula in exact arithmetic
EXACT = "exact"


#: columns that runs of older versions lack, with what goes without saying, by table
UNSAID: Mapping[str, Mapping[str, str | int]] = {"accuracy": {"device": CPU}, "costs": {"reads": 0}}
#: columns of what is done to raw vectors, and their values where nothing is: runs of older versions lack them
RAW = formula_columns.RAW
_INPUTS = (
    _key(
        "stratum",
        "str",
        "highlight, uniform, peak, cutoff, grazing, lengths, normalised, hostile, configurations, cosines, vectors, "
        "devices: what any of them makes unit",
    ),
    _key("perturbation", "str", "wrong lengths: none, a, both, opposite, any, or as a cause such as rsqrt-12 leaves"),
    _key("length_error", "float64", "largest relative error of the vectors' lengths, signed", "1"),
    _key("truth", "str", "exact Phong of the true angle (angle), or of the vectors as they are (given)"),
)
_COVERAGE = _key("coverage", "str", "how maxima were found: sampled, searched, exhaustive, certified, contract")
_SAMPLES = Column("samples", "int64", "inputs evaluated", "count")
_MAX_ABS = Column("max_abs", "float64", "largest |error|, the error being approximation - exact", "1")
_MEAN_ABS = Column("mean_abs", "float64", "mean |error|", "1")
_RMS = Column("rms", "float64", "root of the mean squared error", "1")
_CODES = Column("codes_8bit", "float64", "largest |error| in steps of an 8-bit channel", "codes")
_MODEL = Column("model_max", "float64", "largest error of the formula in exact arithmetic on unit vectors", "1")
_LENGTH = Column("length_max", "float64", "largest change from the vectors' lengths", "1")
_NONFINITE = Column("nonfinite", "int64", "values that are NaN or infinite", "count")
_ABOVE_ONE = Column("above_one", "int64", "values above 1", "count")
_ERRORS = (
    _MAX_ABS,
    _MEAN_ABS,
    _RMS,
    Column("bias", "float64", "mean error", "1"),
    Column("p50_abs", "float64", "median of |error|", "1"),
    Column("p99_abs", "float64", "99 % of |error| are smaller", "1"),
    Column("p999_abs", "float64", "99.9 % of |error| are smaller", "1"),
    Column("max_above", "float64", "largest approximation - exact", "1"),
    Column("max_below", "float64", "largest exact - approximation", "1"),
    _CODES,
    _MODEL,
    _LENGTH,
    Column("rounding_max", "float64", "largest change from the working precision; missing for float64", "1"),
)
_COUNTS = (_NONFINITE, _ABOVE_ONE, Column("negative", "int64", "values below 0", "count"))
_AXES = ("ax", "ay", "az", "bx", "by", "bz")
_HEX = tuple(Column(axis, "str", f"component of vector {axis[0]}", "hex float") for axis in _AXES)
_PICTURE = (
    _key("scene", "str", "name of the scene"),
    _key("width", "int64", "of the picture", "pixels"),
    _key("height", "int64", "of the picture", "pixels"),
    _key("depth", "int64", "reflections followed at most", "count"),
)

ACCURACY = _table(
    "Errors of a cell, a formula at one exponent and precision, on one kind of input",
    *_CELL,
    *_INPUTS,
    _SAMPLES,
    *_ERRORS,
    _COVERAGE,
    *_COUNTS,
    Column("excluded", "int64", "inputs left out of the error statistics: no finite exact value", "count"),
    Column("device", "str", "what computed: cpu, this machine's processor, or gpu, an adapter of it", "", True, True),
)
TIMING = _table(
    "Times of kernels from vectors to values, interleaved with exact Phong's",
    *(_BY_NAME[name] for name in (*_FORMULA, "precision")),
    _key("working_set", "str", "which memory holds the data: l1, l2, memory"),
    Column("elements", "int64", "pairs of a pass", "count"),
    _key("threads", "int64", "threads that ran at once", "count"),
    Column("ns_min", "float64", "least time over clean epochs, per element", "ns"),
    Column("ns_median", "float64", "median time, per element", "ns"),
    *_RATIO,
    Column("verdict", "str", "faster or slower than exact Phong by at least 2 %, or unresolved"),
    Column("dot_ratio", "float64", "time / time of a bare dot product", "1"),
    Column("bandwidth_fraction", "float64", "share of the bandwidth that a copy or a triad reaches", "1"),
    Column("rounds", "int64", "rounds that were kept", "count"),
    Column("contaminated", "int64", "rounds that showed interference and were repeated", "count"),
    Column("repeats", "int64", "passes of an epoch", "count", optional=True),
    Column("compile_ms", "float64", "time of compiling; 0 where a cache had it", "ms", optional=True),
    Column("lit", "float64", "share of pairs that are lit, of kernels that skip dark ones", "1", True, True),
    Column("processes", "int64", "fresh processes whose readings are merged", "count", optional=True),
    *(_BY_NAME[name] for name in RAW),
)
WORST = _table(
    "The inputs of a cell's largest errors",
    *_CELL,
    *_INPUTS,
    _COVERAGE,
    _key("rank", "int64", "1 is the largest, among inputs of unit, wrong and hostile lengths each"),
    Column("error", "float64", "|error| at this input", "1"),
    Column("exact", "float64", "exact Phong at this input", "1"),
    Column("value", "float64", "the formula's value at this input", "1"),
    *_HEX,
)
MESHES = _table(
    "Errors of a cell on normals interpolated over triangles",
    _key("mesh", "str", "icosphere, torus, uv-sphere or a file's name"),
    _key("edge_degrees", "float64", "widest angle between the normals at the ends of an edge", "degrees"),
    Column("triangles", "int64", "of the mesh", "count"),
    Column("left_out", "int64", "degenerate triangles of the file", "count"),
    _key("normals", "str", "raw or renormalised"),
    _key("pair", "str", "classic 2(L.N)N-L, lengthwise 2(N.L)N-(N.N)L, half (N, H)"),
    *_CELL,
    _key("truth", "str", "exact Phong of the interpolated normal made unit (interpolated), or of the surface's"),
    _SAMPLES,
    _MAX_ABS,
    _MEAN_ABS,
    _RMS,
    _CODES,
    _MODEL,
    replace(_LENGTH, meaning="largest change from normals that are not unit; for truth surface, not the surface's"),
    _NONFINITE,
    _ABOVE_ONE,
)
BEHAVIOUR = _table(
    "What a cell makes of a hostile input; alpha and beta are the case's",
    *_CELL,
    _key("case", "str", "name of the input"),
    Column("outcome", "str", "value, saturates, nan, infinite, above-one, negative, refused"),
    Column("lowest", "float64", "smallest value", "1"),
    Column("highest", "float64", "largest value", "1"),
    Column("exact", "float64", "exact Phong; missing where it has no value", "1"),
)
SMOOTHNESS = _table(
    "Shape of a cell's lobe over all angles",
    *_CELL,
    _SAMPLES,
    Column("rises", "int64", "places where it grows away from its peak", "count"),
    Column("largest_rise", "float64", "how far it rises above what it was nearer to the peak", "1"),
    Column("kink", "float64", "second difference at its end, over exact Phong's largest; missing if endless", "1"),
    Column("kink_degrees", "float64", "angle at which it ends", "degrees"),
    Column("overflows", "int64", "samples that are infinite, or at the end of fixed point", "count"),
    Column("subnormals", "int64", "samples that are subnormal", "count"),
)
SCENES = _table(
    "A picture of a scene by a formula against that of exact Phong",
    *_PICTURE,
    *(_BY_NAME[name] for name in ("approximation", "lambda_form", "beta_policy", "gamma")),
    replace(_MAX_ABS, meaning="largest change of a colour"),
    replace(_MEAN_ABS, meaning="mean change of a colour"),
    replace(_RMS, meaning="root of the mean squared change of a colour"),
    Column("psnr", "float64", "peak signal-to-noise ratio", "dB"),
    Column("max_codes", "Int64", "largest change of a stored channel", "codes"),
    Column("visible", "float64", "share of pixels that change by a code or more", "1"),
    Column("flip", "float64", "mean FLIP difference", "1"),
    Column("energy", "float64", "light of the picture over that of exact Phong", "1"),
    Column("highlight_area", "float64", "area of highlights over that of exact Phong", "1"),
    Column("lobe_max", "float64", "bound on a colour's change by the lobe's error, lights and materials", "1"),
    Column("left_out", "str", "why the formula does not fit the scene; there are then no numbers"),
)
SKIPS = _table(
    "What a picture did not need, and what leaving it out changes",
    *_PICTURE,
    _key("name", "str", "the kind of work left out; cutoff: reflections below a contribution"),
    _key("setting", "float64", "that contribution, of name cutoff", "1"),
    Column("kind", "str", "exact or approximate"),
    Column("unit", "str", "what `of` and `skipped` count"),
    Column("of", "Int64", "how many there were", "count"),
    Column("skipped", "Int64", "how many were left out", "count"),
    Column("bound", "float64", "what largest_change may be at most", "1"),
    Column("same_bits", "bool", "the picture without this skip alone has the same bits"),
    Column("largest_change", "float64", "of a colour, against the picture without this skip alone", "1"),
)
SCENE_TIMES = _table(
    "Times in scenes, interleaved",
    _key("scene", "str", "name of the scene; for kind shading infinity or near, where light and viewer are"),
    _key("kind", "str", "formula (over exact Phong), skip (without over with), cutoff (over all followed), shading"),
    _key("name", "str", "the formula, the skip, or the model of kind shading"),
    _key("formula", "str", "of the specular term"),
    _key("setting", "float64", "contribution of kind cutoff, exponent of kind shading"),
    _key("against", "str", "what `ratio` compares with"),
    _key("elements", "int64", "pixels or points", "count"),
    _key("depth", "int64", "reflections followed at most", "count"),
    Column("rounds", "int64", "rounds that were kept", "count"),
    Column("seconds", "float64", "median time", "s"),
    *_RATIO,
)
FAR = _table(
    "What holding directions constant over a square polygon changes, as at its middle, at full strength",
    _key("held", "str", "what is held: L, V or both"),
    _key("term", "str", "diffuse or specular"),
    _key("alpha", "float64", "exponent of the specular term"),
    _key("distance", "float64", "of light and viewer", "sides of the polygon"),
    Column("placements", "int64", "placements of light and viewer", "count"),
    _SAMPLES,
    replace(_MAX_ABS, meaning="largest change over points and placements"),
    Column("incidence_degrees", "float64", "of the worst placement: light from normal", "degrees"),
    Column("offset_degrees", "float64", "of the worst placement: viewer from mirrored light", "degrees"),
)
INCIDENCE = _table(
    "Reflectance of a material by a formula against the exact one, over incidence from 0 to 90 degrees",
    _key("material", "str", "glass or copper"),
    _key("reflectance", "str", "the formula: a kind of fresnel, with the material's own numbers"),
    _key("precision", "str", "working precision"),
    _key("channel", "str", "red, green or blue"),
    _SAMPLES,
    _MAX_ABS,
    Column("worst_degrees", "float64", "incidence of the largest |error|", "degrees"),
    _MEAN_ABS,
    _CODES,
    Column("within_degrees", "float64", "incidence up to which no error exceeds 1/255", "degrees"),
    Column("error_60", "float64", "|error| at 60 degrees", "1"),
    Column("error_85", "float64", "|error| at 85 degrees", "1"),
)
INCIDENCE_TIMES = _table(
    "Times of formulas of reflectance, from a cosine of incidence to one channel, interleaved",
    _key("reflectance", "str", "the formula, or an exact one once more"),
    _key("precision", "str", "working precision"),
    _key("against", "str", "the exact formula that `ratio` compares with"),
    Column("elements", "int64", "cosines of a pass", "count"),
    Column("rounds", "int64", "rounds that were kept", "count"),
    Column("ns", "float64", "least time, per cosine", "ns"),
    *_RATIO,
)
_LOBE = tuple(_BY_NAME[name] for name in ("approximation", "lambda_form", "space", "beta_policy", "alpha", "gamma"))
_OF_LAW = "by closed form, for light along the normal; missing where there is none"
MOMENTS = _table(
    "What the lobe of a formula sends where, above the horizon, for light of unit intensity along its peak",
    *_LOBE,
    _BY_NAME["beta"],
    _key("incidence_degrees", "float64", "of the light, from the normal", "degrees"),
    Column("energy", "float64", "integral of the lobe over directions", "sr"),
    Column("energy_ratio", "float64", "energy over that of exact Phong", "1"),
    Column("momentum", "float64", "the part of it along the mirrored direction", "sr"),
    Column("momentum_ratio", "float64", "momentum over that of exact Phong", "1"),
    Column("sideways", "float64", "the part across it in the plane of incidence, towards the normal", "sr"),
    Column("half_width_degrees", "float64", "angle between R and V at half of the peak; missing if never", "degrees"),
    Column("half_width_ratio", "float64", "half width over that of exact Phong", "1"),
    Column("energy_law", "float64", f"energy {_OF_LAW}", "sr"),
    Column("momentum_law", "float64", f"momentum {_OF_LAW}", "sr"),
)
CUTS = _table(
    "Where the lobe of a formula is cut off, in the plane of incidence",
    *_LOBE,
    Column("cut_degrees", "float64", "angle between R and V from which it is 0; missing where it never is", "degrees"),
    Column("step", "float64", "value a degree before that angle", "1"),
    Column("codes", "float64", "the same in steps of an 8-bit channel", "codes"),
    Column("at_90", "float64", "value at 90 degrees between R and V", "1"),
)
TABLES: Mapping[str, Table] = {
    "accuracy": ACCURACY,
    "timing": TIMING,
    "worst": WORST,
    "meshes": MESHES,
    "behaviour": BEHAVIOUR,
    "smoothness": SMOOTHNESS,
    "scenes": SCENES,
    "skips": SKIPS,
    "scene_times": SCENE_TIMES,
    "far": FAR,
    "incidence": INCIDENCE,
    "incidence_times": INCIDENCE_TIMES,
    "moments": MOMENTS,
    "cuts": CUTS,
    "costs": COSTS,
    "inverse": INVERSE,
    "emitted": EMITTED,
}
#: all metrics of accuracy rows
METRICS = [column.name for column in (*_ERRORS, *_COUNTS)]
#: those that say how wrong a cell is, smaller being better: what a front is drawn of
ERROR_METRICS = [column.name for column in _ERRORS if column.name != "bias"]
#: what identifies a measured case: an accuracy row but for its coverage, of which `Records.strongest` chooses
CASE = [name for name in ACCURACY.key if name != _COVERAGE.name]
#: what identifies a formula of a run at one precision, the kernel that it is timed by, and an input to it
CELL = [*_FORMULA, "precision", *RAW]
KERNEL = [name for name in CELL if name != "beta_policy"]
INPUT = ["alpha", "stratum", "perturbation", "length_error"]
