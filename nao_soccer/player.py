"""One player: what it perceives becomes a world state, a decision and a direction for its head.

player = Player(settings, start)
player.world.add_odometry(stamp, pose)
player.world.add_percepts(percepts)
decision = player.decide(behavior, body, now)
goal = player.look(decision.world, decision.action.head)
"""

from dataclasses import replace

from nao_soccer.behavior.mind import Decision
from nao_soccer.behavior.player_behavior import PlayerBehavior
from nao_soccer.behavior.situation import Body
from nao_soccer.world.looking import Looking
from nao_soccer.world.model import WorldModel
from nao_soccer.world.settings import WorldSettings
from nao_soccer.world.state import HeadMode, WorldState
from robot_core.head_goals import Goal
from robot_core.types import Pose2


class Player:
    """World model and head of one robot.

    Args:
        settings: Of the world model.
        start: Pose in the field of its team at which it begins, and to which the referee puts it
            with a penalty; None = not known.

    Attributes:
        world: Takes percepts, odometry, falls and team messages.
    """

    def __init__(self, settings: WorldSettings, start: Pose2 | None = None) -> None:
        self.world = WorldModel(settings)
        self._looking = Looking(self.world.map)
        self._start = start
        self._was_penalized = False
        self._begin_at_start()

    def decide(self, behavior: PlayerBehavior, body: Body, now: int) -> Decision | None:
        """Decide by what the robot and its team mates see.

        Args:
            behavior: What decides; it has heard the referee and the team mates.
            body: The robot's body.
            now: Time [ns] of the robot's clock.

        Returns:
            The decision; None before the first odometry.
        """
        if behavior.take_late_start():
            self.world.forget_place()
        penalized = behavior.game.penalized
        if self._was_penalized and not penalized:
            self._begin_at_start()  # there the referee has put the robot
        self._was_penalized = penalized
        for mate in behavior.link.mates(now * 1e-9):
            self.world.add_mate(mate)
        state = self.world.state()
        if state is None:
            return None
        return behavior.update(replace(state, stamp=now), body)

    def look(self, state: WorldState, mode: HeadMode) -> Goal | None:
        """Where the head looks in a state of the world; None leaves it to the gait."""
        return self._looking.goal(mode, state) if state.upright else None

    def _begin_at_start(self) -> None:
        if self._start is not None:
            self.world.start((self._start,))
