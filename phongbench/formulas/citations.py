"""The bibliography: one Source for everything that a formula, table or constant was taken from."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Source:
    """Where a formula comes from.

    key     str         stable identifier, e.g. "LYON_1993"
    text    str         authors, title, where published
    year    int         year of publication
    checked str         what was checked against the source's formula here, and how far to trust the citation
    """

    key: str
    text: str
    year: int
    checked: str = "formula checked against its own law in the tests; citation quoted from memory"

    @property
    def citation(self) -> str:
        """The text with its year, ready to print."""
        return f"{self.text} ({self.year})"


PHONG_1975 = Source("PHONG_1975", "B. T. Phong, Illumination for Computer Generated Pictures, CACM 18(6)", 1975)
BLINN_1977 = Source(
    "BLINN_1977", "J. F. Blinn, Models of Light Reflection for Computer Synthesized Pictures, SIGGRAPH", 1977
)
LYON_1993 = Source(
    "LYON_1993",
    "R. F. Lyon, Phong Shading Reformulation for Hardware Renderer Simplification, Apple Technical Report 43",
    1993,
)
SCHLICK_1994 = Source(
    "SCHLICK_1994", "C. Schlick, A Fast Alternative to Phong's Specular Model, Graphics Gems IV", 1994
)
SCHLICK_1994_BRDF = Source(
    "SCHLICK_1994_BRDF",
    "C. Schlick, An Inexpensive BRDF Model for Physically-based Rendering, Computer Graphics Forum 13(3)",
    1994,
)
FISHER_WOO_1994 = Source(
    "FISHER_WOO_1994", "F. Fisher and A. Woo, R.E versus N.H Specular Highlights, Graphics Gems IV", 1994
)
LAGARDE_2012 = Source(
    "LAGARDE_2012", "S. Lagarde, Relationship between Phong and Blinn lighting models, personal web log", 2012
)
KUIJK_BLAKE_1989 = Source(
    "KUIJK_BLAKE_1989",
    "A. A. M. Kuijk and E. H. Blake, Faster Phong Shading via Angular Interpolation, Computer Graphics Forum 8",
    1989,
    "formula and constants from Kuijk's own posting (comp.graphics.research, 19 September 1991): he says that the "
    "print has a and b exchanged; only the corrected pair tends to Phong, which the tests check",
)
SCHRAUDOLPH_1999 = Source(
    "SCHRAUDOLPH_1999",
    "N. N. Schraudolph, A Fast, Compact Approximation of the Exponential Function, Neural Computation 11",
    1999,
)
KARIS_2013 = Source("KARIS_2013", "B. Karis, PhongApprox in Unreal Engine's shading code (spherical Gaussian)", 2013)
DOOM_3 = Source(
    "DOOM_3",
    "id Software, Doom 3: the specular ramp of R_SpecularTableImage in its released source code",
    2004,
    "formula read in the source code released in 2011, which has the power 16 beside it, switched off",
)
LYGIA = Source(
    "LYGIA",
    "P. Gonzalez Vivo, LYGIA shader library: powFast(a, b) = a / ((1 - b) a + b)",
    2021,
    "formula read in the library's source code",
)
FONSECA_2008 = Source(
    "FONSECA_2008",
    "J. Fonseca, Fast SSE2 pow: tables or polynomials? (personal web log)",
    2008,
    "polynomial quoted from memory, its error computed here",
)
MESA_TABLE = Source("MESA_TABLE", "Mesa 3D, the specular exponent table of its fixed-function lighting", 1995)
OPENGL_MATERIALS = Source(
    "OPENGL_MATERIALS", "M. Kilgard, the material table of the OpenGL teapots demo (teapots.c), Silicon Graphics", 1994
)
PHONGBENCH = Source(
    "PHONGBENCH", "phongbench: derived here, proved by the tests", 2026, "derived and tested in this project"
)
WIKIPEDIA_PHONG = Source(
    "WIKIPEDIA_PHONG",
    "Phong reflection model, Wikipedia; what it says on lengths is marked as lacking a citation there",
    2022,
    "claims read in its revision of April 2022",
)
WIKIPEDIA_BLINN = Source(
    "WIKIPEDIA_BLINN", "Blinn-Phong shading model, Wikipedia", 2022, "claims read in a copy of the article"
)
LOMONT_2003 = Source(
    "LOMONT_2003",
    "C. Lomont, Fast Inverse Square Root, technical report, Purdue University",
    2003,
    "constant quoted from memory; the errors that it leaves are computed here",
)
FRESNEL = Source(
    "FRESNEL",
    "A. Fresnel's equations for a complex index, as in M. Born and E. Wolf, Principles of Optics",
    1823,
    "formula checked against complex arithmetic in the tests; citation quoted from memory",
)
LAZANYI_2005 = Source(
    "LAZANYI_2005",
    "I. Lazanyi and L. Szirmay-Kalos, Fresnel Term Approximations for Metals, WSCG, whose correction of Schlick's "
    "formula later renderers fix at a cosine of 1/7 (82 degrees)",
    2005,
    "formula checked against its own values in the tests; citation quoted from memory",
)
JOHNSON_CHRISTY_1972 = Source(
    "JOHNSON_CHRISTY_1972",
    "P. B. Johnson and R. W. Christy, Optical Constants of the Noble Metals, Physical Review B 6",
    1972,
    "n and k of copper as tables in common use give them; the interpolated values are checked in the tests",
)
HYPERGRAPH = Source(
    "HYPERGRAPH", "G. S. Owen, HyperGraph, ACM SIGGRAPH Education Committee", 1999, "claims quoted from memory"
)
BOOM_2009 = Source(
    "BOOM_2009",
    "B. J. Boom, L. J. Spreeuwers and R. N. J. Veldhuis, Model-Based Illumination Correction for Face Images in "
    "Uncontrolled Scenarios, Computer Analysis of Images and Patterns",
    2009,
    "normals from Phong's model; its text on lines and cylinders as the design quotes it",
)
