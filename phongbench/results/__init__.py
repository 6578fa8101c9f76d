"""Stored runs: schema, files, origin."""
