"""A picture for light and for dark pages at once."""


def of_both(light: bytes, dark: bytes) -> bytes:
    """One picture that is light or dark as the reader's screen is, of two that differ in their style sheets only.

    Safari shows it light on every screen: where there is room for two files, two are better.
    """
    start, end = b"<style", b"</style>"
    usual, other = (one[one.index(start) : one.index(end)].splitlines() for one in (light, dark))
    rules = b"".join(theirs for ours, theirs in zip(usual, other, strict=True) if ours != theirs)
    return light.replace(end, b"@media (prefers-color-scheme:dark){" + rules + b"}\n" + end, 1)
