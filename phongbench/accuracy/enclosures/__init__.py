"""Proven bounds of the error of a formula as it is computed: model, lengths and rounding together, for all pairs."""
