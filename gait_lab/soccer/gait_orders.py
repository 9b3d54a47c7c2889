"""What a player decides, as requests to a gait in the same process."""

from dataclasses import replace

from nao_lipm_gait.gait import Gait
from nao_lipm_gait.whole_body.step_kick import BALL
from nao_soccer.behavior.situation import Action
from robot_core.errors import NaoGaitError
from robot_core.head_goals import Follow, Goal, LookAt
from robot_core.types import VelocityCommand


class GaitOrders:
    """Asks the gait of one robot for what its player decides.

    Args:
        gait: Its gait.
        size: Lengths of the robot's world per length of the player's.
        radius: Of the ball [m].

    Attributes:
        kicks: Names of the kicks that the gait accepted; they are motions.
    """

    def __init__(self, gait: Gait, size: float = 1.0, radius: float = BALL) -> None:
        self._gait, self._size, self._radius = gait, size, radius
        self.kicks: list[str] = []
        self.forget()

    def forget(self) -> None:
        """A motion that was asked for last may be asked for again."""
        self._motion = ""

    def give(self, action: Action, look: Goal | None) -> VelocityCommand:
        """Ask for an action, and to look at a goal; the velocity at which to walk."""
        gait, size, motion = self._gait, self._size, action.motion
        if motion and motion != self._motion:
            try:
                gait.request_motion(motion)
                if motion.startswith("kick"):
                    self.kicks.append(motion)
            except NaoGaitError:
                pass  # the robot does not have it, or falls
        self._motion = motion
        gait.request_lift(action.lift)
        if action.kick is not None:
            x, y, direction = action.kick
            gait.request_kick((size * x, size * y), direction, self._radius)
        gait.request_look(self._in_own_size(look))
        walk = action.walk
        return VelocityCommand(size * walk.x, size * walk.y, walk.yaw)

    def _in_own_size(self, goal: Goal | None) -> Goal | None:
        if not isinstance(goal, LookAt | Follow):
            return goal
        x, y, z = (self._size * each for each in goal.point)
        return replace(goal, point=(x, y, z))
