"""From the world model to an action, at every update."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from nao_lipm_gait.types import STAND, Point2
from nao_soccer.behavior.ball_plan import BallPlan, Planner, PlanSettings
from nao_soccer.behavior.engine import Activation, Engine
from nao_soccer.behavior.kicks import KickTable
from nao_soccer.behavior.options import PLAYER
from nao_soccer.behavior.situation import Action, Body, Role, Situation
from nao_soccer.behavior.walking import WalkLimits, kept_apart
from nao_soccer.field import Field, Goals
from nao_soccer.game_state import GameState
from nao_soccer.world.state import TeamMate, WorldState

VALID_MEMORY = 2_000_000_000
"""[ns] A pose that was valid so short a time ago is good enough to choose a kick."""


class Decision(NamedTuple):
    """What was decided, and why.

    Attributes:
        action: What to do.
        path: The activation path.
        plan: What to do with the ball; None while none is known.
    """

    action: Action
    path: tuple[Activation, ...]
    plan: BallPlan | None


class Mind:
    """The behaviour of one player.

    Args:
        number: Number of the player.
        table: The kicks of the robot.
        field: The field.
        goals: The goals.
        limits: Largest speeds.
        settings: How plans are compared.
    """

    def __init__(
        self,
        number: int,
        table: KickTable,
        field: Field,
        goals: Goals,
        limits: WalkLimits | None = None,
        settings: PlanSettings | None = None,
    ) -> None:
        self._number = number
        self._field = field
        self._goals = goals
        self._limits = WalkLimits() if limits is None else limits
        self._planner = Planner(table, self._limits, field, goals, settings)
        self._engine = Engine(PLAYER)
        self._plan: BallPlan | None = None
        self._last_valid: int | None = None

    def update(
        self,
        world: WorldState,
        body: Body,
        game: GameState | None = None,
        role: Role = Role.STRIKER,
        striker: TeamMate | None = None,
    ) -> Decision:
        """Decide.

        Args:
            world: The world model.
            body: What the gait reports.
            game: The state of the game; None = a game without a referee.
            role: The own role.
            striker: The team mate who is the striker, if it is another one.

        Returns:
            The decision.
        """
        if world.own.valid or self._last_valid is None:
            self._last_valid = world.stamp
        self._plan = self._planned(world, body)
        situation = Situation(
            world,
            GameState() if game is None else game,
            body,
            role,
            self._number,
            self._plan,
            self._field,
            self._goals,
            self._limits,
            striker,
            self._lost(world),
        )
        action, path = self._engine.update(situation, world.stamp * 1e-9)
        walk = kept_apart(action.walk, situation.near_robots(), self._limits)
        action = replace(action, walk=walk)
        return Decision(action, path, self._plan)

    def _lost(self, world: WorldState) -> bool:
        last = self._last_valid
        return last is not None and world.stamp - last > VALID_MEMORY

    def _planned(self, world: WorldState, body: Body) -> BallPlan | None:
        if world.ball is None:
            return None
        robots: Sequence[Point2] = [each.position_in_field for each in world.obstacles]
        return self._planner.choose(
            world.own.pose,
            world.ball.position_in_field,
            robots,
            self._plan,
            valid=not self._lost(world),
            stands=body.state is STAND,
        )
