"""Scenes: read, traced, shaded by the library, and what of the work could be left out."""
