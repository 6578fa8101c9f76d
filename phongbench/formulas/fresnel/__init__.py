"""Reflectance against incidence: how much of the light that falls in at an angle is mirrored, formula by formula."""
