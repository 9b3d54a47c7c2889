"""Robots that play on a simulated pitch, in one process, with percepts by the model."""

import contextlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from gait_lab.soccer.channels import Channels
from gait_lab.soccer.eyes import Eyes, ModelEyes, Sight, in_field
from gait_lab.soccer.gait_orders import GaitOrders
from gait_lab.soccer.percept_model import OtherRobot
from gait_lab.vision.percept_errors import load_percept_errors
from nao_lipm_gait.gait import Gait
from nao_soccer.behavior.duel import DuelSettings
from nao_soccer.behavior.mind import Decision
from nao_soccer.behavior.option_tree import Activation
from nao_soccer.behavior.situation import Body
from nao_soccer.player import Identity, Player
from nao_soccer.referee.rules import TEAM_NUMBERS
from nao_soccer.vision.percepts import ROBOT_OF
from nao_soccer.vision.settings import VisionSettings
from nao_soccer.world.settings import WorldSettings
from robot_core.errors import NaoGaitError
from robot_core.field import TEAMS, BallPlace, Field, Goals
from robot_core.robot import RobotDescription
from robot_core.types import DOWN, GETTING_UP, STANDSTILL, GaitStatus, Point2, Point3, Pose2
from sim_bridge.cameras.camera import CameraSettings
from sim_bridge.plant import Plant
from sim_bridge.robot import GroundTruth
from sim_bridge.scene import Scene, SceneBall, SceneRobot, load_scene
from sim_bridge.trials.trial import Action, Policy, Tick, make_gaits, make_scene_world, run_several
from sim_bridge.world import World

if TYPE_CHECKING:
    from gait_lab.soccer.eyes_process import EyesProcess

MIND_TICKS = 5
"""Control periods between two updates of the behaviour."""
LYING = 0.22
"""[m] A lower torso is that of a robot that lies or has begun to get up."""


class RobotPlayer(Policy):
    """One robot on a pitch: eyes, player and gait.

    Attributes:
        runs: The process of the player runs; without it, the gait gets no commands and stands.
    """

    def __init__(
        self, pitch: "Pitch", index: int, player: Player, eyes: Eyes, gait: Gait
    ) -> None:
        self.gait = gait
        self._orders = GaitOrders(gait)
        self._pitch = pitch
        self._index = index
        self._eyes = eyes
        self._count = 0
        self.start(player)

    def start(self, player: Player) -> None:
        """Start the process of the player: it knows nothing of one before."""
        self.player = player
        self._stamp: int | None = None
        self.decision: Decision | None = None
        self.runs = True
        self._orders.forget()
        self._walk = STANDSTILL

    def command(self, time: float, tick: Tick | None) -> Action:
        """Sense in every period, decide in some."""
        if tick is None or tick.status is None or not self.runs:
            return STANDSTILL
        self._sense(tick.truth, tick.status)
        self._count += 1
        if self._count % MIND_TICKS == 0:
            self._decide(time, tick.status)
        return self._walk

    def _sense(self, truth: GroundTruth, status: GaitStatus) -> None:
        pitch, world = self._pitch, self.player.world
        world.set_upright(status.state not in (*DOWN, GETTING_UP))
        if status.stamp != self._stamp:
            self._stamp = status.stamp
            with contextlib.suppress(NaoGaitError):  # a jump after the robot was put back
                world.add_odometry(status.stamp, status.base_footprint_in_odom)
        sight = Sight(pitch.world.time, truth, pitch.ball, pitch.others(self._index))
        for percepts in self._eyes.arrived(sight):
            with contextlib.suppress(NaoGaitError):  # parts that cannot be used are left out
                world.add_percepts(percepts)

    def _decide(self, time: float, status: GaitStatus) -> None:
        player = self.player
        decision = player.decide(Body(status.state), round(time * 1e9))
        if decision is None:
            return
        self.decision = decision
        self._walk = self._orders.give(decision.action, player.look(decision))
        data = player.team_message(time)
        if data is not None:
            self._pitch.tell(self._index, data, time)

    @property
    def kicks(self) -> list[str]:
        """Names of the kicks so far, which are motions of a standing robot."""
        return self._orders.kicks

    @property
    def path(self) -> tuple[Activation, ...]:
        """The activation path of the last decision; empty before the first."""
        return () if self.decision is None else self.decision.path

    def put_back(self) -> None:
        """The referee has put the robot beside the field."""
        self.gait.reset()
        self.gait.request_stand()
        self._orders.forget()


class Pitch(AbstractContextManager["Pitch"]):
    """The world of a scene, and its robots as players. Use it as a context manager.

    Args:
        scene: With field, goals, ball and robots.
        seed: Of sensor noise, percepts and radio.
        engine: Physics engine.
        plant: The plant, or its name or file.
        identity: Who a robot of the scene is; None = one who plays at once, without a referee.
        loss: Share of team messages that are lost.
        rendered: Percepts are seen in rendered images, and do not come from the model.
        visual: The world can be rendered, for pictures.
        eyes: Number of further processes that render and see; 0 = this one does.
        channels: Ways of images, percepts and messages to the players; None = without faults.
        duel: How the robots of a team play beside others, where it is not the default.

    Attributes:
        players: In the order of the scene's robots.
        messages_of: Number of team messages that were sent, by team.
        poses: True poses of the robots in the world.
        count: Control periods so far.
        falls: How often each robot fell.

    Raises:
        NaoGaitError: The scene lacks something.
    """

    def __init__(
        self,
        scene: Scene,
        seed: int,
        engine: str,
        plant: str | Plant,
        identity: Callable[[SceneRobot], Identity] | None = None,
        *,
        loss: float = 0.0,
        rendered: bool = False,
        visual: bool = False,
        eyes: int = 0,
        channels: Channels | None = None,
        duel: Mapping[str, DuelSettings] | None = None,
    ) -> None:
        self.channels = Channels() if channels is None else channels
        self.field, self.goals, ball = parts_of(scene)
        self.ball_radius = ball.radius
        self.scene = scene
        first = max(seed, 0)  # the nominal robot has the number -1
        self.world = make_scene_world(
            scene,
            plant=plant,
            engine=engine,
            noise_seed=100 * first,
            cameras=CameraSettings() if rendered else None,
            visual=visual,
        )
        self.messages_of = dict.fromkeys(TEAMS, 0)
        self.count = 0
        self.falls = [0] * len(scene.robots)
        self._upright = [True] * len(scene.robots)
        self._loss = loss
        self._random = np.random.default_rng([23, first])
        self._teams = [robot.team for robot in scene.robots]
        self.poses: list[Pose2] = [robot.pose for robot in scene.robots]
        self._seen = [OtherRobot(ROBOT_OF[robot.team], robot.pose[:2]) for robot in scene.robots]
        self._vision = VisionSettings(
            field=self.field, goals=self.goals, poles=scene.poles, ball_radius=ball.radius
        )
        self._processes: list[EyesProcess] = []
        if rendered and eyes:
            from gait_lab.soccer import eyes_process

            drawn = eyes_process.EyesSpec(scene, plant, engine, 100 * first, self._vision)
            self._processes = [eyes_process.EyesProcess(drawn) for _ in range(eyes)]
        self.players = []
        self._starts: list[tuple[Identity, RobotDescription, WorldSettings, Pose2]] = []
        for index, (robot, gait) in enumerate(
            zip(scene.robots, make_gaits(self.world), strict=True)
        ):
            number = 1000 * first + index
            sees = self.channels.eyes(index, self._eyes_of(index, gait, number, rendered=rendered))
            settings = WorldSettings.on(self._vision, number)
            who = identity_of(robot, scene, waits=False) if identity is None else identity(robot)
            description = self.world.robots[index].description
            start = who, description, settings, in_field(robot.pose, robot.team)
            self._starts.append(start)
            player = Player(*start, duel=(duel or {}).get(robot.team))
            self.players.append(RobotPlayer(self, index, player, sees, gait))

    def _eyes_of(self, index: int, gait: Gait, number: int, *, rendered: bool) -> Eyes:
        """What gives the robot with an index its percepts; `number` seeds the model's errors."""
        robot = self.world.robots[index]
        if self._processes:
            from gait_lab.soccer.eyes_process import RemoteEyes

            process = self._processes[index % len(self._processes)]
            return RemoteEyes(process, self.world, index, gait)
        if rendered:
            # OpenCV is an extra, which the percept model does not need.
            from gait_lab.soccer.rendered_eyes import RenderedEyes

            return RenderedEyes(robot, gait, self._vision, partial(self.channels.image, index))
        team, errors = self._teams[index], load_percept_errors()
        return ModelEyes(robot.description, team, self.field, self.goals, errors, number)

    def restart_player(self, index: int, kind: Callable[..., Player] = Player) -> None:
        """Start the process of a player anew; `kind` makes it of the arguments of `Player`."""
        self.players[index].start(kind(*self._starts[index]))

    @property
    def messages(self) -> int:
        """Number of team messages that were sent."""
        return sum(self.messages_of.values())

    @property
    def ball(self) -> Point2:
        """x, y [m] of the ball."""
        x, y, _ = self.ball_position
        return x, y

    @property
    def ball_position(self) -> Point3:
        """x, y, z [m] of the ball."""
        ball = self.world.ball
        assert ball is not None
        x, y, z = ball.position.tolist()
        return x, y, z

    @property
    def ball_in(self) -> BallPlace:
        """Where the ball is by the rules."""
        return self.field.place_of(self.ball_position, self.ball_radius, self.goals)

    def others(self, index: int) -> list[OtherRobot]:
        """All robots but one, as they are seen."""
        return [each for number, each in enumerate(self._seen) if number != index]

    def tell(self, index: int, data: bytes, time: float) -> None:
        """Send a team message to the team mates; some are lost."""
        self.messages_of[self._teams[index]] += 1
        for number, player in enumerate(self.players):
            mate = number != index and self._teams[number] == self._teams[index]
            if mate and self._random.random() >= self._loss:
                for each in self.channels.team_message(number, data):
                    with contextlib.suppress(NaoGaitError):  # the node logs it
                        player.player.hear_mate(each, time)

    def run(
        self, watch: Callable[[Sequence[Tick]], None] = lambda _: None
    ) -> Iterator[Sequence[Tick]]:
        """Step the world by control periods; yields the ticks of all robots.

        `watch` is called at the beginning of each period with the last ticks; it may put the ball.
        """

        def disturb(_: World, ticks: Sequence[Tick]) -> None:
            self.poses = [tick.truth.base_footprint for tick in ticks]
            self._seen = [
                _seen_as(robot, pose, tick)
                for robot, pose, tick in zip(self.scene.robots, self.poses, ticks, strict=True)
            ]
            for index, upright in enumerate(map(is_upright, ticks)):
                self.falls[index] += self._upright[index] and not upright
                self._upright[index] = upright
            watch(ticks)

        gaits = [player.gait for player in self.players]
        for ticks in run_several(self.world, gaits, self.players, disturb):
            yield ticks
            self.count += 1

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Free the engine, and end the further processes."""
        for process in self._processes:
            process.close()
        self.world.close()


def _seen_as(robot: SceneRobot, pose: Pose2, tick: Tick) -> OtherRobot:
    """What others see of a robot: its feet, or its torso if it lies."""
    x, y, height = tick.truth.torso_position.tolist()
    lies = height < LYING
    return OtherRobot(ROBOT_OF[robot.team], (x, y) if lies else pose[:2], lies)


def is_upright(tick: Tick) -> bool:
    """The robot neither lies nor gets up."""
    down = tick.status is not None and tick.status.state in (*DOWN, GETTING_UP)
    return not (tick.fallen or down)


def parts_of(scene: Scene) -> tuple[Field, Goals, SceneBall]:
    """Field, goals and ball of a scene; NaoGaitError if it lacks one of them."""
    if scene.field is None or scene.goals is None or scene.ball is None:
        raise NaoGaitError("scene", scene.name, "a scene with field, goals and ball")
    return scene.field, scene.goals, scene.ball


def identity_of(robot: SceneRobot, scene: Scene, *, waits: bool, roles: bool = True) -> Identity:
    """Who a robot of a scene is."""
    players = sum(each.team == robot.team for each in scene.robots)
    return Identity(
        TEAM_NUMBERS[robot.team], robot.number, players, waits, roles, robot.team
    )


def with_robots(
    scene: Scene,
    red: Sequence[Pose2],
    blue: Sequence[Pose2] = (),
    *,
    urdf: str | None = None,
    seed: int = 0,
) -> Scene:
    """A scene with other robots, of the teams red and blue, who have the numbers from 1 on.

    The first robot is the individual `seed`, the next ones follow; `urdf` None = that of the scene.
    """
    places = [("red", *each) for each in enumerate(red, start=1)]
    places += [("blue", *each) for each in enumerate(blue, start=1)]
    robots = tuple(
        SceneRobot(
            name=f"{team}{number}", team=team, number=number, pose=pose, seed=seed + index,
            urdf=urdf or scene.robots[0].urdf,
        )
        for index, (team, number, pose) in enumerate(places)
    )  # fmt: skip
    return scene.replace(robots=robots)


@dataclass(frozen=True, slots=True, kw_only=True)
class PitchSpec:
    """What every trial on a field depends on. Small and picklable.

    Attributes:
        seed: Of the individuals, their sensors and percepts, and all that is drawn.
        urdf: What all robots are; None = as in the scene.
    """

    seed: int = 0
    scene: str = "pitch_small"
    urdf: str | None = None
    engine: str = "mujoco"
    plant: str | Plant = "reference"

    def practice(
        self, red: Sequence[Pose2], blue: Sequence[Pose2] = (), *, ball: Point2 | None = None,
        rendered: bool = False,
    ) -> "Pitch":  # fmt: skip
        """The field with robots at these poses, who play at once, without a referee.

        The ball [m] starts as in the scene if it is not given.
        """
        scene = with_robots(load_scene(self.scene), red, blue, urdf=self.urdf, seed=self.seed)
        if ball is not None and scene.ball is not None:
            scene = scene.replace(ball=scene.ball.replace(x=ball[0], y=ball[1]))
        return Pitch(scene, self.seed, self.engine, self.plant, rendered=rendered)
