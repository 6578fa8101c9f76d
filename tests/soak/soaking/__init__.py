"""Programs that go on for minutes: random input without end, and every fault of the disk and of time."""
