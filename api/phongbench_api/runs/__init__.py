"""Stored runs as the service reads them."""
