"""The command `phongbench`: each command parses, calls the library once, and prints."""
