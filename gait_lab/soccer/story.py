"""What happened in a match and why, told from its moments: events, touches, numbers by robot."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from gait_lab.soccer.match import AT_BALL, DUEL, MatchResult, match_scene
from gait_lab.soccer.motion_track import PERIOD
from gait_lab.soccer.snapshots import RobotSnapshot, Snapshot
from nao_soccer.game_state import Phase
from nao_soccer.referee.rules import TOUCH, TOUCH_SPEED, Goal
from robot_core.field import SIDES, TEAMS
from robot_core.types import FloatArray, Point2

BESIDE = 0.5
"""[m] between two robots of which one may have made the other fall."""
SAME_TOUCH = 1.0
"""[s] between two hits of one robot that count as one touch."""
PUT = 0.25
"""[m] that a ball moves within `PERIOD` only if it is put somewhere."""
AFTER_KICK = 3.0
"""[s] in which the way of a kicked ball is measured."""
ATTACK = 20.0
"""[s] before a goal in which the touches that led to it are looked for."""
TURNED = 3.0
"""[s] for which a robot takes one half for the other before this is told."""
_PENALTIES = {
    "incapable": "it lay for too long",
    "leaving": "it left the field",
    "illegal_position": "it stood in the other half at the kick-off",
}


class Event(NamedTuple):
    """Something that happened.

    Attributes:
        time: [s].
        kind: `goal`, `fall`, `kick`, `out`, `penalty`, `lost` or `whistle`.
        team: Whose; empty for both.
        why: How it came about; may be empty.
        place: Where [m]; None for events of the whole game.
    """

    time: float
    kind: str
    team: str
    text: str
    why: str = ""
    place: Point2 | None = None


class Touch(NamedTuple):
    """Hits of one robot that follow each other.

    Attributes:
        time: [s] of the first one.
        robot: Its name.
        team: Its team.
        place: Of the ball at first [m].
        gain: [m] by which the ball came nearer to the other team's goal line.
        doing: What the robot was at.
    """

    time: float
    robot: str
    team: str
    place: Point2
    gain: float
    doing: str


class Story:
    """A match, told from a result that has frames and motion.

    Attributes:
        touches: In order.
        events: In order.
        duels: From when to when [s] robots of both teams were at the ball.
    """

    def __init__(self, result: MatchResult) -> None:
        assert result.motion is not None
        scene = match_scene(result.spec)
        self.frames: Sequence[Snapshot] = result.frames
        self.teams = {robot.name: robot.team for robot in scene.robots}
        assert scene.field is not None
        self._half_length = scene.field.length / 2.0
        motion = result.motion
        self._goals = result.goals
        self._time, self._ball = motion.time, motion.ball[:, :2]
        self._places = {
            name: motion.body(index)[:, :2] for index, name in enumerate(self.teams)
        }
        self.touches = self._find_touches()
        self.duels = self._find_duels()
        self.events = sorted(
            (
                *self._whistles(), *self._goal_events(), *self._outs(),
                *(event for name in self.teams for event in self._of_robot(name)),
            )
        )  # fmt: skip

    # -- the ball ----------------------------------------------------------------------------------

    def ball_at(self, time: float) -> Point2:
        """x, y [m] of the ball."""
        x, y = self._ball[self._row(time)].tolist()
        return x, y

    def frame_at(self, time: float) -> Snapshot:
        """The last frame up to a time [s]; the first one before that."""
        index = int(np.searchsorted([frame.time for frame in self.frames], time, "right"))
        return self.frames[max(0, index - 1)]

    def to_goal(self, team: str, place: Point2) -> float:
        """[m] from a place to the goal that a team plays at."""
        return math.hypot(-SIDES[TEAMS.index(team)] * self._half_length - place[0], place[1])

    def _row(self, time: float) -> int:
        return min(int(np.searchsorted(self._time, time)), len(self._time) - 1)

    def _find_touches(self) -> list[Touch]:
        hits: list[tuple[float, str]] = []
        ball, step = self._ball, 2
        for row in range(step, len(ball) - step):
            ways = ball[row] - ball[row - step], ball[row + step] - ball[row]
            change = (ways[1] - ways[0]) / (step * PERIOD)
            if math.hypot(*change) < TOUCH_SPEED or _longest(ball, row, step) > PUT:
                continue
            name = self._beside(row, change)
            if name:
                hits.append((float(self._time[row]), name))
        groups: list[list[tuple[float, str]]] = []
        for hit in hits:
            last = groups[-1] if groups else None
            if last is not None and last[-1][1] == hit[1] and hit[0] - last[-1][0] < SAME_TOUCH:
                last.append(hit)
            else:
                groups.append([hit])
        ends = [*(group[0][0] for group in groups), float(self._time[-1])][1:]
        return [self._touch(group, end) for group, end in zip(groups, ends, strict=True)]

    def _beside(self, row: int, change: FloatArray) -> str:
        """The robot from which a change of the ball's velocity leads away, if one is near."""
        ball, best = self._ball[row], (TOUCH, "")
        for name, places in self._places.items():
            away = ball - places[row]
            gap = float(np.hypot(*away))
            if float(away @ change) >= 0.0:
                best = min(best, (gap, name))
        return best[1]

    def _touch(self, hits: Sequence[tuple[float, str]], until: float) -> Touch:
        (begin, name), end = hits[0], hits[-1][0]
        team = self.teams[name]
        first, last = self._row(begin), self._row(min(until, end + AFTER_KICK))
        steps = np.hypot(*np.diff(self._ball[first : last + 1], axis=0).T)
        if (steps > PUT).any():  # up to where it was taken away
            last = first + int(np.argmax(steps > PUT))
        way = -SIDES[TEAMS.index(team)] * float(self._ball[last, 0] - self._ball[first, 0])
        doing = self.frame_at(begin).robots[name].doing
        return Touch(begin, name, team, self.ball_at(begin), way, doing)

    def _find_duels(self) -> list[tuple[float, float]]:
        duels: list[list[float]] = []
        for frame in self.frames:
            near = {
                self.teams[name]
                for name, robot in frame.robots.items()
                if not robot.down and math.dist((robot.x, robot.y), frame.ball) < AT_BALL
            }
            if frame.phase != Phase.PLAYING or len(near) < len(TEAMS):
                continue
            if duels and frame.time - duels[-1][1] < DUEL:
                duels[-1][1] = frame.time
            else:
                duels.append([frame.time, frame.time])
        return [(begin, end) for begin, end in duels if end - begin >= DUEL]

    # -- the game ----------------------------------------------------------------------------------

    def _whistles(self) -> Iterator[Event]:
        half = 0
        for before, frame in pairwise(self.frames):
            if frame.phase == before.phase:
                continue
            if frame.phase == Phase.PLAYING:
                team = frame.kicking
                text = f"kick-off for {team}" if team else "play goes on"
                yield Event(frame.time, "whistle", team, text)
            elif frame.phase == Phase.FINISHED:
                half += 1
                text = "end of the first half" if half == 1 else "end of the match"
                yield Event(frame.time, "whistle", "", text)

    def _goal_events(self) -> Iterator[Event]:
        red = blue = 0
        for goal in self._goals:
            red, blue = red + (goal.team == "red"), blue + (goal.team == "blue")
            own = ", an own goal" if goal.own else ""
            by = f" by {goal.player}{own}" if goal.player else ""
            text = f"goal for {goal.team}{by}: red {red} : {blue} blue"
            yield Event(
                goal.time, "goal", goal.team, text, self._cause(goal), self.ball_at(goal.time)
            )

    def _cause(self, goal: Goal) -> str:
        """The touches that led to a goal, and where the other team was."""
        before = [
            each for each in self.touches if goal.time - ATTACK < each.time <= goal.time
        ]
        told = []
        chain: list[Touch] = []
        for each in reversed(before):
            if each.team != goal.team and not goal.own:
                break
            chain.insert(0, each)
        if chain:
            first, last = chain[0], chain[-1]
            told.append(
                f"{first.robot} came to the ball {self.to_goal(goal.team, first.place):.1f} m "
                f"from the goal {goal.time - first.time:.1f} s earlier"
            )
            told.append(
                f"{last.robot} hit it last, {self.to_goal(goal.team, last.place):.1f} m away"
                f" ({_last(last.doing)})"
            )
        told += self._opponents(goal.team, goal.time)
        return "; ".join(told)

    def _opponents(self, team: str, time: float) -> list[str]:
        frame = self.frame_at(time - 1.0)
        told = []
        for name, robot in frame.robots.items():
            if self.teams[name] == team:
                continue
            if robot.penalty:
                told.append(f"{name} was taken off")
            elif robot.down:
                told.append(f"{name} lay on the ground")
            else:
                gap = math.dist((robot.x, robot.y), frame.ball)
                told.append(f"{name} was {gap:.1f} m from the ball ({_last(robot.doing)})")
        return told

    def _outs(self) -> Iterator[Event]:
        for before, frame in pairwise(self.frames):
            if frame.phase != Phase.PLAYING or before.phase != Phase.PLAYING:
                continue
            if frame.set_play and frame.set_play != before.set_play:
                kind = frame.set_play.replace("_", "-", 1) if "in" in frame.set_play else (
                    frame.set_play.replace("_", " ")
                )
                text = f"ball out: {kind} for {frame.kicking}"
                yield Event(
                    frame.time, "out", frame.kicking, text, self._last_touch(before.time),
                    before.ball,
                )  # fmt: skip
            elif not frame.set_play and math.dist(frame.ball, before.ball) > 5.0 * PUT:
                text = "the ball rested for too long and was put to the middle"
                yield Event(frame.time, "out", "", text, "", before.ball)

    def _last_touch(self, time: float) -> str:
        last = next((each for each in reversed(self.touches) if each.time <= time), None)
        return "" if last is None else f"touched last by {last.robot} ({_last(last.doing)})"

    # -- robots ------------------------------------------------------------------------------------

    def _of_robot(self, name: str) -> Iterator[Event]:
        team, turned_since = self.teams[name], math.inf
        for before_frame, frame in pairwise(self.frames):
            before, robot = before_frame.robots[name], frame.robots[name]
            place = robot.x, robot.y
            if robot.down and not before.down:
                yield Event(
                    frame.time, "fall", team, f"{name} falls",
                    self._fall_cause(name, before_frame, frame.time), place,
                )  # fmt: skip
            if robot.kicks > before.kicks:
                yield self._kick(name, before, robot, frame)
            if robot.penalty and not before.penalty:
                why = _PENALTIES.get(robot.penalty, robot.penalty.replace("_", " "))
                yield Event(frame.time, "penalty", team, f"{name} is taken off", why, place)
            if not robot.turned or frame.phase != Phase.PLAYING or robot.down:
                turned_since = math.inf
            elif turned_since == math.inf:
                turned_since = frame.time
            elif frame.time - turned_since > TURNED >= before_frame.time - turned_since:
                text = f"{name} takes one half for the other"
                yield Event(frame.time, "lost", team, text, "", place)

    def _fall_cause(self, name: str, frame: Snapshot, time: float) -> str:
        robot = frame.robots[name]
        gap, other = min(
            (math.dist((robot.x, robot.y), (each.x, each.y)), each_name)
            for each_name, each in frame.robots.items()
            if each_name != name
        ) if len(frame.robots) > 1 else (math.inf, "")
        told = [_last(robot.doing)] if robot.doing else []
        if gap < BESIDE:
            there = frame.robots[other]
            miss = min((math.dist(each, (there.x, there.y)) for each in robot.others), default=9.0)
            known = "of which it did not know" if miss > BESIDE else (
                f"which it saw {miss:.2f} m from its place"
            )
            told.append(f"{other} {gap:.2f} m away, {known}")
        else:
            told.append(f"no robot within {BESIDE:g} m")
        later = (each for each in self.frames if each.time > time)
        up = next((each for each in later if not each.robots[name].down), None)
        if up is not None and not up.robots[name].penalty:
            told.append(f"up again after {up.time - time:.1f} s")
        return "; ".join(told)

    def _kick(
        self, name: str, before: RobotSnapshot, robot: RobotSnapshot, frame: Snapshot
    ) -> Event:
        team, plan = self.teams[name], robot.plan or before.plan
        move = "" if plan is None else f" {plan.name.removeprefix('kick_').replace('_', ' ')}"
        told = []
        if plan is not None:
            told.append(f"expected to be in the goal after {plan.seconds:.1f} s")
        runner = robot.runner_up or before.runner_up
        if runner is not None:
            told.append(f"second choice {runner.name.replace('_', ' ')} {runner.seconds:.1f} s")
        end = self.ball_at(frame.time + AFTER_KICK)
        told.append(f"the ball went {math.dist(end, frame.ball):.1f} m")
        place = robot.x, robot.y
        return Event(frame.time, "kick", team, f"{name} kicks{move}", "; ".join(told), place)

    # -- numbers -----------------------------------------------------------------------------------

    def numbers(self) -> list["RobotNumbers"]:
        """Of each robot."""
        return [self._numbers(name) for name in self.teams]

    def _numbers(self, name: str) -> "RobotNumbers":
        played = walked = down = 0.0
        errors = []
        for before, frame in pairwise(self.frames):
            robot, last = frame.robots[name], before.robots[name]
            if frame.phase != Phase.PLAYING or robot.penalty or last.penalty:
                continue
            dt = frame.time - before.time
            played += dt
            down += dt * robot.down
            if not robot.down:
                walked += math.dist((robot.x, robot.y), (last.x, last.y))
                if robot.believed is not None:
                    errors.append(math.dist(robot.believed[:2], (robot.x, robot.y)))
        mine = [each for each in self.touches if each.robot == name]
        events = [each.kind for each in self.events if each.text.startswith(f"{name} ")]
        return RobotNumbers(
            name,
            self.teams[name],
            sum(goal.player == name and not goal.own for goal in self._goals),
            len(mine),
            sum(each.gain for each in mine),
            events.count("kick"),
            events.count("fall"),
            walked,
            played,
            down,
            float(np.median(errors)) if errors else math.nan,
        )

    def possession(self) -> Mapping[str, float]:
        """Share of the playing time after a touch of each team."""
        times = [each.time for each in self.touches]
        held = dict.fromkeys(TEAMS, 0.0)
        for before, frame in pairwise(self.frames):
            index = int(np.searchsorted(times, frame.time, "right")) - 1
            if frame.phase == Phase.PLAYING and index >= 0:
                held[self.touches[index].team] += frame.time - before.time
        total = sum(held.values())
        return {team: value / total if total else 0.0 for team, value in held.items()}


@dataclass(frozen=True, slots=True)
class RobotNumbers:
    """What one robot did while the ball was in play.

    Attributes:
        gain: [m] by which they brought the ball forward.
        walked: [m].
        played: [s] on the field.
        down: [s] of these on the ground.
        pose_error: [m] median of its own place.
    """

    name: str
    team: str
    goals: int
    touches: int
    gain: float
    kicks: int
    falls: int
    walked: float
    played: float
    down: float
    pose_error: float


def _longest(ball: FloatArray, row: int, step: int) -> float:
    """[m] of the longest single step around a row."""
    return float(np.hypot(*np.diff(ball[row - step : row + step + 1], axis=0).T).max())


def _last(doing: str) -> str:
    """The state of what a robot is at, without its option."""
    return doing.rpartition(": ")[2] or "nothing"
