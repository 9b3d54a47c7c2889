"""What became of a motion that was requested: done, refused, replaced or aborted."""

from nao_lipm_gait.motion.scheduler import GET_UP
from robot_core.types import DOWN, GETTING_UP, STAND, GaitState


class MotionRequests:
    """Follows the last requested motion to its end.

    Each method returns what became of a motion, as `name: outcome`, or None while that is open.
    """

    def __init__(self) -> None:
        self._name: str | None = None
        self._started = False

    def refuse(self, name: str, reason: str) -> str:
        """A request was refused; a motion requested before it is not affected."""
        return f"{name}: refused, {reason}"

    def request(self, name: str) -> str | None:
        """A motion was requested and accepted; it replaces one that is not done."""
        replaced, self._name, self._started = self._name, name, False
        return None if replaced is None else f"{replaced}: replaced by {name}"

    def update(self, state: GaitState, running: str, waits: bool, ended: bool) -> str | None:
        """Follow one tick of the gait.

        Args:
            state: State of the gait.
            running: Name of the running motion; empty without one.
            waits: A requested motion or get-up has not begun yet.
            ended: The running motion has reached its last keyframe, which it holds.
        """
        name = self._name
        if name is None:
            return None
        if name == GET_UP:
            self._started = self._started or state is GETTING_UP
            if self._started and state is STAND:
                return self._close("done")
            given_up = state is not GETTING_UP and not waits
            return self._close(f"aborted, the robot is {state.value}") if given_up else None
        if running == name and not waits:
            self._started = True
            return self._close("done") if ended else None
        if self._started:
            # A motion to the floor or the stand is over in the tick in which it reaches its end.
            return self._close(f"aborted, the robot is {state.value}" if state in DOWN else "done")
        return None if waits else self._close(f"aborted, the robot is {state.value}")

    def _close(self, outcome: str) -> str:
        name, self._name = self._name, None
        return f"{name}: {outcome}"
