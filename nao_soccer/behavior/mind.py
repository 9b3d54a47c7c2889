"""From the world model to an action, at every update."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from nao_soccer.behavior.ball_plan import BallPlan, Planner
from nao_soccer.behavior.duel import DuelSettings
from nao_soccer.behavior.kicks import KickTable
from nao_soccer.behavior.option_tree import Activation, OptionTree
from nao_soccer.behavior.options import PLAYER
from nao_soccer.behavior.situation import Action, Body, Situation
from nao_soccer.behavior.walking import APART_FROM, Round, WalkLimits, kept_apart
from nao_soccer.game_state import GameState, Phase, Role
from nao_soccer.world.looking import unseen_robot
from nao_soccer.world.state import HeadMode, TeamMate, WorldState
from robot_core.field import Field, Goals
from robot_core.types import STAND, Point2

VALID_MEMORY = 2_000_000_000
"""[ns] A pose that was valid so short a time ago is good enough to choose a kick."""
WAY_PERIOD, WAY_GLANCE, WAY_WATCH = 2.4, 0.8, 1.6
"""[s] Between two glances along the way; how long one lasts: a turn of the head and two images.
While nothing but landmarks is looked for, or a robot near by may have moved, it lasts longer."""
WAY_SPEED = 0.12
"""[m/s] ahead, from which on the way is watched."""
IN_VIEW = 0.5
"""[rad] Bearing up to which a ball that is looked at shows the way too."""


class Decision(NamedTuple):
    """What was decided, and why.

    Attributes:
        world: The world it was decided in.
        path: The activation path.
        plan: What to do with the ball; None while none is known.
    """

    world: WorldState
    action: Action
    path: tuple[Activation, ...]
    plan: BallPlan | None


class Mind:
    """The behaviour of one player; the planner decides what to do with the ball."""

    def __init__(
        self,
        table: KickTable,
        field: Field,
        goals: Goals,
        limits: WalkLimits | None = None,
        *,
        dives: bool = True,
        planner: Planner | None = None,
        duel: DuelSettings | None = None,
    ) -> None:
        self._field = field
        self._goals = goals
        self._limits = WalkLimits() if limits is None else limits
        self._planner = planner or Planner(table, self._limits, field, goals)
        self._dives = dives
        self._duel = DuelSettings() if duel is None else duel
        self._engine = OptionTree(PLAYER)
        self._plan: BallPlan | None = None
        self._last_valid: int | None = None
        self._lost = False

    def reset(self) -> None:
        """Begin anew: times from before no longer count."""
        self._engine.reset()
        self._plan = None
        self._last_valid = None
        self._lost = False

    @property
    def lost(self) -> bool:
        """The own pose has not been valid for a while."""
        return self._lost

    def update(
        self,
        world: WorldState,
        body: Body,
        game: GameState | None = None,
        role: Role = Role.STRIKER,
        striker: TeamMate | None = None,
        rank: int = 0,
    ) -> Decision:
        """Decide.

        Args:
            world: The world model.
            body: What the gait reports.
            game: The state of the game; None = a game without a referee.
            role: The own role.
            striker: The team mate who is the striker, if it is another one.
            rank: Place among the supporters, from 0.
        """
        if world.own.valid or self._last_valid is None:
            self._last_valid = world.stamp
        self._lost = world.stamp - self._last_valid > VALID_MEMORY
        game = GameState() if game is None else game
        if game.phase is not Phase.PLAYING:
            self._plan = None  # nothing has begun that would be worth keeping
        self._plan = self._planned(world, body, game)
        situation = Situation(
            world,
            game,
            body,
            role,
            self._plan,
            self._field,
            self._goals,
            self._limits,
            striker,
            rank,
            self._lost,
            self._dives,
            self._duel,
        )
        action, path = self._engine.update(situation, world.stamp * 1e-9)
        walk = kept_apart(action.walk, situation.near_robots(), self._limits)
        if situation.gives_way and world.ball is not None and role is not Role.KEEPER:
            # Whatever the state of the tree: the ball is the other team's.
            near = Round(situation.ball, game.ball_distance, APART_FROM)
            walk = kept_apart(walk, [near], self._limits)
        kick = action.kick if walk.x > 0.0 else None  # who kicks while it steps back falls
        low = any(math.hypot(*each.position) < self._duel.lift_near for each in world.obstacles)
        action = replace(
            action, walk=walk, head=_watching_way(action, situation), kick=kick,
            lift=self._duel.lift if low else 1.0,
        )  # fmt: skip
        return Decision(world, action, path, self._plan)

    def _planned(self, world: WorldState, body: Body, game: GameState) -> BallPlan | None:
        if world.ball is None:
            return None
        robots: Sequence[Point2] = [each.position_in_field for each in world.obstacles]
        return self._planner.choose(
            world.own.pose,
            world.ball.position_in_field,
            robots,
            self._plan,
            valid=not self._lost,
            stands=body.state is STAND,
            scores=game.may_score,
        )


def _watching_way(action: Action, s: Situation) -> HeadMode:
    """What the head looks for: now and then other robots, unless it looks along the way anyway."""
    near = not action.walk.is_zero and unseen_robot(s.world) is not None
    if action.head is HeadMode.LOCALIZE:
        watches = not (s.lost or action.walk.is_zero)
    else:
        ball = s.world.ball
        follows = ball is not None and ball.seen_recently
        on_way = follows and abs(math.atan2(s.ball[1], s.ball[0])) < IN_VIEW
        ahead = action.walk.x >= WAY_SPEED and not on_way
        watches = action.head is HeadMode.AUTO and (near or ahead)
    lasts = WAY_WATCH if near or action.head is HeadMode.LOCALIZE else WAY_GLANCE
    glances = watches and s.world.stamp * 1e-9 % WAY_PERIOD < lasts
    return HeadMode.AHEAD if glances else action.head
