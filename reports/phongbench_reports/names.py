"""What the registry says of a formula, with a fallback for one that only its user's run knew."""

from phongbench.formulas.registry import REGISTRY


def title(name: str) -> tuple[str, str, str, str]:
    """Title, kind, formula and citation of an approximation; a name the registry lacks is titled as it is."""
    if name not in REGISTRY:
        return name, "user's own", "–", "–"
    spec = REGISTRY[name]
    return str(spec.title), str(spec.kind), str(spec.formula), str(spec.source.citation)
