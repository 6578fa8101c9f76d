"""`python -m load.health PORT SECONDS`: looks at health from a process of its own, prints what came."""

import asyncio
import json
import sys

from load.lines import Lines, due, head

#: seconds between two looks
EVERY = 0.02


async def look(port: int, seconds: float) -> list[tuple[float, float, int]]:
    """When each look was due, how long its answer took, and its status."""
    lines = Lines(port)
    try:
        return (await due(lines, head("GET", "/healthz"), EVERY, seconds)).answers
    finally:
        lines.close()


if __name__ == "__main__":
    json.dump(asyncio.run(look(int(sys.argv[1]), float(sys.argv[2]))), sys.stdout)
