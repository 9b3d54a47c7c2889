"""Python's garbage collector, kept off the tick.

A full collection takes some milliseconds and comes when it likes. Here it comes right after an
answer was sent, when there is much to collect; all of it while the robot rests.
"""

import gc

RESTING = 2_000
"""Container objects made since the last collection, from which a resting gait collects them all."""
WALKING = 20_000
"""The same for a walking gait, which looks through the young ones only: about a millisecond."""


class GarbageKeeper:
    """Switches the automatic collector off and stands in for it."""

    def __init__(self) -> None:
        self.collections = 0
        """Of either kind, since the start."""
        gc.disable()

    def after_tick(self, resting: bool) -> None:
        """To be called when the answer is on its way."""
        made = gc.get_count()[0]
        if made > (RESTING if resting else WALKING):
            gc.collect() if resting else gc.collect(0)
            self.collections += 1

    def close(self) -> None:
        """Give the collector back."""
        gc.enable()
