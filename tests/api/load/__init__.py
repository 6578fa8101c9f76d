"""How fast the service is, over loopback: against an echo of the same bytes, against its own health, and overloaded."""
