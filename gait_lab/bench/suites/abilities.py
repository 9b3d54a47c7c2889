"""The suite `abilities`: single situations of the soccer papers, with percepts by the model.

- `backheel`, Fig. 10 of Friedmann et al.: the goal is behind the robot, the ball at its heel. It
  sees neither, but knows its pose and has seen the ball. It scores by a kick backwards.
- `two at the ball`, Fig. 11: of two robots that see the ball, the nearer one goes on, the other one
  steps back.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from gait_lab.bench.options import Option, Options
from gait_lab.bench.rows import Row, rows_of
from gait_lab.bench.suite import suite
from gait_lab.bench.walks import median
from gait_lab.soccer.pitch import PitchSpec, RobotPlayer
from nao_soccer.game_state import GameState, Phase, Role
from nao_soccer.vision.percepts import Kind, Percept, Percepts
from robot_core.field import BallPlace
from robot_core.geometry import relative
from robot_core.types import Pose2
from sim_bridge.trials.trial import CONTROL_PERIOD

HEEL_BALL = 1.85, -0.06
"""[m] Ball before the opponents' goal on the small pitch."""
HEEL_START = 1.75, 0.0, math.pi
"""The robot stands before it with its back to the goal."""
HEEL_WAIT, HEEL_ERROR = 1.5, 0.005
"""[s] of standing in which it finds its pose and has seen the ball; [m] deviation of that."""
HEEL_LIMIT = 15.0
"""[s] for the goal."""
PAIR_BALL = 0.1, 0.0
PAIR = (-0.35, 0.0, 0.0), (-0.3, 0.55, -0.9)
"""Two team mates at a ball."""
PAIR_TIME, PAIR_LIMIT = 4.0, 10.0
"""[s] after which it is judged who does what: as soon as the ball moves, and at the latest. A robot
that kicks stands first."""
PAIR_PUSHED, PAIR_APART = 0.3, 0.7
"""[m] by which the ball has moved towards the goal, and distance of the one who steps back."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AbilitySpec(PitchSpec):
    """One trial of an ability.

    Attributes:
        name: One of `ABILITIES`.
    """

    name: str


@dataclass(frozen=True, slots=True)
class AbilityResult:
    """What came of it.

    Attributes:
        seconds: [s] that it took; None if they did not.
    """

    spec: AbilitySpec
    done: bool
    seconds: float | None
    doing: str


def play_ability(spec: AbilitySpec) -> AbilityResult:
    """Run one trial."""
    return ABILITIES[spec.name](spec)


def _backheel(spec: AbilitySpec) -> AbilityResult:
    with spec.practice([HEEL_START]) as pitch:
        pitch.world.put_ball(*HEEL_BALL)
        robot = pitch.players[0]
        robot.player.game = GameState(phase=Phase.SET)
        goal, time = False, 0.0
        for _ in pitch.run():
            time = pitch.count * CONTROL_PERIOD
            if time >= HEEL_WAIT:
                robot.player.game = GameState(phase=Phase.PLAYING)
            elif robot.player.world.state() is not None:
                _show_ball(robot, pitch.world.time, relative((*HEEL_BALL, 0.0), pitch.poses[0]))
            goal = pitch.ball_in is BallPlace.IN_BLUE_GOAL
            if goal or time > HEEL_LIMIT:
                break
        kicks, path = robot.kicks, robot.path
    done = goal and len(kicks) == 1 and "backheel" in kicks[0]
    doing = ", ".join(kicks) or " > ".join(map(str, path))
    return AbilityResult(spec, done, time - HEEL_WAIT if goal else None, doing)


def _show_ball(robot: RobotPlayer, now: int, place: Pose2) -> None:
    """The robot has just seen the ball, which it does not see any more where it stands now."""
    ball = Percept(Kind.BALL, place[:2], (HEEL_ERROR**2, 0.0, HEEL_ERROR**2))
    robot.player.world.add_percepts(Percepts(now, ball))


def _two_at_ball(spec: AbilitySpec) -> AbilityResult:
    with spec.practice(PAIR) as pitch:
        pitch.world.put_ball(*PAIR_BALL)
        for _ in pitch.run():
            time, moved = pitch.count * CONTROL_PERIOD, pitch.ball[0] - PAIR_BALL[0]
            if time >= PAIR_LIMIT or (time >= PAIR_TIME and moved > PAIR_PUSHED):
                break
        apart = math.dist(pitch.poses[1][:2], PAIR_BALL)
        roles = [robot.player.role for robot in pitch.players]
    done = roles == [Role.STRIKER, Role.SUPPORTER] and moved > PAIR_PUSHED and apart > PAIR_APART
    doing = f"{', '.join(roles)}; ball moved {moved:.2f} m, the other one at {apart:.2f} m"
    return AbilityResult(spec, done, time if done else None, doing)


ABILITIES: dict[str, Callable[[AbilitySpec], AbilityResult]] = {
    "backheel": _backheel,
    "two at the ball": _two_at_ball,
}
"""The abilities by their names."""
NAMES = tuple(ABILITIES)


@suite(
    "abilities", "Abilities", "backheel with the goal behind, two at the ball",
    options={
        "robots": 20,
        "abilities": Option(NAMES, "which ability", "NAME", ("--ability",), choices=NAMES),
    },
    gait=False, quick=({"robots": 4},),
)  # fmt: skip
def abilities(options: Options) -> Iterator[Row | str]:
    """Each robot plays each situation once."""
    specs = [AbilitySpec(name=name, seed=seed, **options.play)
             for name in options.abilities for seed in options.seeds]  # fmt: skip
    results: list[AbilityResult] = options.map(
        play_ability, specs, label="abilities",
        note=lambda result: f"{result.spec.name}, robot {result.spec.seed}: {result.doing}",
    )  # fmt: skip
    for name in options.abilities:
        mine = [each for each in results if each.spec.name == name]
        done = sum(each.done for each in mine)
        times = [each.seconds for each in mine if each.seconds is not None]
        yield from rows_of(
            name.replace(" ", "_"),
            ("done", "%", 100.0 * done / len(mine)),
            ("seconds_median", "s", median(times)),
            ("seconds_worst", "s", max(times, default=None) if done == len(mine) else None),
        )
    yield (
        "backheel: the goal is behind the robot, unseen; it scores by a kick backwards. two at the "
        "ball: the nearer robot goes on, the other one steps back (judged 4 to 10 s later)."
    )
