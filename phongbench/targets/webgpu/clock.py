"""Which clock can be believed: the device's timestamps, or else the wall's time around a submission.

Timestamps are nanoseconds by WebGPU's word; on some backends they stand still, run backwards, or count ticks of another
unit. So they are held beside the wall's time of the same work, short and long.
"""

from collections.abc import Sequence
from dataclasses import dataclass

TIMESTAMPS, WALL = "timestamps", "wall time"
#: what a long pass takes more than a short one, by timestamps over by the wall, where both count nanoseconds: units
#: that are in use differ by 10 and more, what else runs on the machine does not
UNIT = 0.5, 2.0


@dataclass(frozen=True, slots=True)
class Passes:
    """Readings of the passes of a submission.

    stamps  of each pass (begin, end); none where the device has no clock
    wall    nanoseconds of the whole submission, waiting for it included
    """

    stamps: tuple[tuple[int, int], ...]
    wall: int

    def nanoseconds(self, place: int) -> int:
        """Of one pass, by timestamps."""
        begin, end = self.stamps[place]
        return end - begin


def fault(short: Sequence[Passes], long: Sequence[Passes]) -> str | None:
    """Why timestamps cannot be believed, None where they can.

    short, long  readings of one pass each, of the same work few times and several times as often
    """
    every = [*short, *long]
    if not all(one.stamps for one in every):
        return "the device has no timestamps"
    stamped = [one.nanoseconds(0) for one in every]
    if min(stamped) < 0:
        return "timestamps run backwards"
    if min(stamped) == 0:
        return "timestamps stand still"
    if len({one.stamps[0][0] for one in every}) < len(every):
        return "timestamps stand still between passes"
    more = min(one.nanoseconds(0) for one in long) - min(one.nanoseconds(0) for one in short)
    wall = min(one.wall for one in long) - min(one.wall for one in short)
    if more <= 0:
        return "timestamps of longer work are no longer"
    if wall <= 0 or not UNIT[0] <= more / wall <= UNIT[1]:
        return (
            f"timestamps count {more / wall:.3g} a nanosecond of the wall's" if wall > 0 else "the wall's time stands"
        )
    return None
