"""The colours of all figures, each with its counterpart on dark pages."""

SURFACE, INK, MUTED, GRID = "#fcfcfd", "#1b2330", "#586374", "#dde1e7"
#: Okabe and Ito's colours, safe for the colour-blind, their yellow left out (unreadable on white).
BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY = "#0072b2", "#d55e00", "#009e73", "#b8609c", "#d99000", "#56b4e9"
DARK = {
    SURFACE: "#161b23",
    INK: "#e4e8ee",
    MUTED: "#9aa6b6",
    GRID: "#2d3541",
    BLUE: "#3fa0e0",
    VERMILION: "#f0803c",
    GREEN: "#2fc397",
    PURPLE: "#dd95c3",
    ORANGE: "#f2b33a",
    SKY: "#9bd6fb",
}
