"""One player on the server: what it perceives, decides, says, and where it begins.

It plays at the size of a NAO: lengths are divided by the size of its robot, see `field`.
"""

import contextlib
import math
from dataclasses import replace

from gait_lab.rcss.eyes import ServerEyes
from gait_lab.rcss.field import BALL, ServerField
from gait_lab.rcss.game import GOAL, Mode, game_state, mode_of
from gait_lab.rcss.speech import pack, unpack
from gait_lab.soccer.gait_orders import GaitOrders
from nao_lipm_gait.gait import Gait
from nao_lipm_gait.parameters import load_preset
from nao_lipm_gait.presets import DEFAULT
from nao_soccer.behavior.ball_plan import Planner, PlanSettings
from nao_soccer.behavior.duel import DuelSettings
from nao_soccer.behavior.kicks import kicks_of
from nao_soccer.behavior.mind import Decision
from nao_soccer.behavior.situation import Body
from nao_soccer.behavior.walking import WalkLimits
from nao_soccer.game_state import GameState
from nao_soccer.player import Identity, Player
from nao_soccer.team.message import decode
from nao_soccer.world.settings import WorldSettings
from rcss_bridge.codec import Percepts
from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription
from robot_core.types import DOWN, GETTING_UP, STANDSTILL, Pose2, SensorFrame, VelocityCommand

DECIDES, LOOKS = 2, 4
"""Cycles between two decisions, and between two images that are used."""
FREE_DISTANCE = 0.5
"""[m] farther from the ball of a set play than the rule wants."""
BEHIND_BALL = 0.25
"""[m] of a NAO, from the ball of an own set play to whoever waits for it."""
WAITED_FOR = "kickoff", "kickin", "corner_kick", "free_kick", "direct_free_kick"
"""Own set plays that nobody takes: whoever did could not touch the ball again before somebody else.
When their time is over, the ball is free, and the other team still far from it."""
PLANS = PlanSettings(dribble_speed=0.1, past=5.0)
"""Among opponents a dribbled ball hardly gets on; a kick goes past those in its way."""
PACE = 1.2
"""Share of a NAO's speeds that is asked for: the field is large, the floor even and hard."""
TEAM_SIZE, NUMBER_MAX = 11, 99
UNSEEN, SIGHT, DEVIATION = 40.0, 7.0, 0.5
"""Of `WorldSettings`: the landmarks are up to 20 m apart, few are seen, and from afar."""


class ServerPlayer:
    """World model, behaviour, head and voice of one robot.

    Args:
        robot: The robot.
        gait: Its gait.
        team: Name of its team.
        number: Its number; 1 is the goalkeeper.
        field: Name of the server's field.
        exact: Percepts without errors, misses and delay.
        seed: Of their errors and of the particles; players of other numbers have others.

    Attributes:
        player: World model and behaviour; made before the player joins, whom the server does not
            wait for.
        command: Velocity at which to walk.
        start: Where to be put, x, y [m], yaw [rad] in the field of the team; None = nowhere.
        speech: What to say in this cycle.
        decision: The last one.
    """

    def __init__(
        self,
        robot: RobotDescription,
        gait: Gait,
        team: str,
        number: int,
        field: str,
        *,
        exact: bool = False,
        seed: int = 0,
    ) -> None:
        self._gait, self._size = gait, robot.size
        self._team, self._number = team, number
        self._field = ServerField(field, self._size)
        ground, goals, limits = self._field.field, self._field.goals, walk_limits(gait)
        kicks = kicks_of(f"{robot.motions}_rcss")
        seed = seed * (NUMBER_MAX + 1) + number
        self.player = Player(
            Identity(0, number, TEAM_SIZE),
            robot,
            WorldSettings(
                field=ground, goals=goals, poles=self._field.poles, seed=seed,
                unseen=UNSEEN, sight=SIGHT, deviation=DEVIATION,
            ),
            limits=limits,
            planner=Planner(kicks, limits, ground, goals, PLANS),
            duel=DuelSettings(receive_ahead=4.0, receive_aside=0.08),  # where a kick ends
        )
        self._orders = GaitOrders(gait, self._size, BALL)
        self._eyes = ServerEyes(robot, self._field, team, number, exact=exact, seed=seed)
        self.command: VelocityCommand = STANDSTILL
        self.start: Pose2 | None = None
        self.speech: bytes | None = None
        self.decision: Decision | None = None
        self._mode = Mode("", None)
        self._counts: dict[int, int] = {}
        self._cycle = 0
        self._put: tuple[Pose2, ...] = ()
        self._joined = False

    # -- places ------------------------------------------------------------------------------------

    def watch(self, percepts: Percepts) -> None:
        """See what is played; `start` says where to be put. Call it in every cycle."""
        game = percepts.game
        mode = mode_of(game, self._team)
        self._cycle += 1
        self.start = self.speech = None
        if not self._joined:
            self._joined, right = True, game.right == self._team
            self._eyes.places = self._field.places(right)
            self._put = (self._field.spawn(self._number, right),)
        if mode == self._mode:
            return
        self._mode = mode
        if mode.puts_back:
            conceded = mode.name == GOAL and not mode.ours
            x, y, yaw = self._field.start(self._number, kicks_off=conceded)
            self.start = self._size * x, self._size * y, yaw

    def dropped(self, pose: Pose2 | None) -> None:
        """The robot has landed: at a pose [m] in the field of its team, or beside the field."""
        if pose is not None:
            self._put = ((pose[0] / self._size, pose[1] / self._size, pose[2]),)
        elif not self._put:
            self._put = self._field.entries()

    # -- perceiving and deciding -------------------------------------------------------------------

    def update(self, percepts: Percepts, frame: SensorFrame) -> None:
        """Perceive and decide, after the gait has answered the same frame."""
        player, status = self.player, self._gait.status
        now, time = status.stamp, status.stamp * 1e-9
        world = player.world
        world.set_upright(status.state not in (*DOWN, GETTING_UP))
        x, y, yaw = status.base_footprint_in_odom
        with contextlib.suppress(NaoGaitError):  # it jumps after a drop
            world.add_odometry(now, (x / self._size, y / self._size, yaw))
        if self._put:
            world.start(self._put, place=0.3, heading=0.1)
            self._put = ()
        if percepts.sight is not None and self._cycle % LOOKS < 2:
            self._eyes.look(now, percepts.sight, frame.joint_position, self._gait.torso_pose)
        for seen in self._eyes.arrived(now):
            with contextlib.suppress(NaoGaitError):  # parts that cannot be used are left out
                world.add_percepts(seen)
        self._hear(player, percepts, time)
        if self._cycle % DECIDES == 0:
            self._decide(player, percepts, now)

    def _hear(self, player: Player, percepts: Percepts, time: float) -> None:
        for heard in percepts.heard:
            with contextlib.suppress(NaoGaitError):  # another team's
                message = unpack(heard.data, self._team, self._size)
                count = self._counts.get(message.player, 0) + 1
                self._counts[message.player] = count
                player.hear_mate(replace(message, count=count).encode(), time)

    def _decide(self, player: Player, percepts: Percepts, now: int) -> None:
        time = now * 1e-9
        player.hear_game(self._game(percepts), time)
        decision = player.decide(Body(self._gait.state), now)
        if decision is None:
            return
        self.decision = decision
        self.command = self._orders.give(decision.action, player.look(decision))
        data = player.team_message(time)
        if data is not None:
            self.speech = pack(decode(data), self._team, self._size)

    def _game(self, percepts: Percepts) -> GameState:
        """The state of the game, as far as this player may take part in it."""
        circle = self._field.field.circle_diameter / 2.0
        keep = circle + FREE_DISTANCE / self._size
        game = game_state(percepts.game, self._team, self._number, keep)
        if self._mode.ours and self._mode.name in WAITED_FOR:
            return replace(game, own_kick=False, ball_distance=BEHIND_BALL)
        return game


def walk_limits(gait: Gait) -> WalkLimits:
    """The largest speeds that behaviour asks of a robot, at the size of a NAO.

    They are a NAO's, in proportion to the steps of the robot, which take longer if it is larger.
    """
    nao, own, limits = load_preset(DEFAULT), gait.parameters, WalkLimits()
    pace = PACE / math.sqrt(gait.robot.size)
    return WalkLimits(**{
        name: pace * getattr(limits, name) * getattr(own, step) / getattr(nao, step)
        for name, step in _STEPS.items()
    })  # fmt: skip


_STEPS = {
    "forward": "step_forward_max", "backward": "step_backward_max", "side": "step_side_max",
    "turn": "step_turn_max",
}  # fmt: skip
