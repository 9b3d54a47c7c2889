"""The progress of a match: a bar on a terminal, elsewhere a line per minute."""

from contextlib import AbstractContextManager

from gait_lab.soccer.snapshots import Snapshot
from sim_bridge.trials.progress import Progress


class MatchProgress(AbstractContextManager["MatchProgress"]):
    """The progress in simulated time, with phase and score."""

    def __init__(self, *, shown: bool = True) -> None:
        self._shown = shown
        self._bar: Progress | None = None

    def show(self, frame: Snapshot, total: float) -> None:
        """Show a moment of a match that takes `total` seconds."""
        if self._bar is None:
            self._bar = Progress(
                total=round(total), unit="s", desc="match", show=self._shown
            )
        self._bar.set_postfix_str(
            f"{frame.phase}, red {frame.score[0]} : {frame.score[1]} blue", refresh=False
        )
        self._bar.update(min(frame.time, self._bar.total or 0.0) - self._bar.n)

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.close()
