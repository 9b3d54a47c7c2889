"""The ways of images, percepts and messages to the players of a pitch."""

from collections.abc import Sequence

from gait_lab.soccer.eyes import Eyes
from sim_bridge.cameras.camera import CameraImage


class Channels:
    """Delivers everything at once and unchanged; a subclass may delay, change or lose it."""

    def image(self, index: int, camera: str, newest: CameraImage) -> CameraImage | None:
        """What the vision of a robot gets of the newest image of a camera, in each period."""
        return newest

    def eyes(self, index: int, eyes: Eyes) -> Eyes:
        """What gives a robot its percepts; `eyes` does without a fault."""
        return eyes

    def team_message(self, index: int, data: bytes) -> Sequence[bytes]:
        """What a robot receives of a message of a team mate."""
        return (data,)

    def referee_message(self, index: int, data: bytes, time: float) -> Sequence[bytes]:
        """What a robot receives of a message that the referee sends at `time` [s]."""
        return (data,)


class SilentReferee(Channels):
    """No robot receives messages of the referee from `begin` to `end` [s]."""

    def __init__(self, begin: float, end: float) -> None:
        self._begin, self._end = begin, end

    def referee_message(self, index: int, data: bytes, time: float) -> Sequence[bytes]:
        """See `Channels`."""
        return () if self._begin <= time < self._end else (data,)
