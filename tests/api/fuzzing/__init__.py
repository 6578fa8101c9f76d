"""Requests nobody should send, sent to the application in its own process: none may be answered by a 5xx."""
