"""A match in one process with faults on the ways to one of its players, and what must not happen.

World, players and referee are those of `nao_gait bench match`; see `Channels` for the ways.
"""

import math
from collections import deque
from collections.abc import Iterable, Sequence

import numpy as np

from gait_lab.channel import Channel
from gait_lab.faults.harness import PERIOD, Fault
from gait_lab.faults.messages import Delivery
from gait_lab.soccer.channels import Channels
from gait_lab.soccer.eyes import Eyes, Sight
from gait_lab.soccer.match import Match, MatchSpec
from gait_lab.soccer.pitch import RobotPlayer
from gait_lab.soccer.snapshots import Snapshot
from nao_soccer.game_state import Phase
from nao_soccer.vision.percepts import Percepts
from nao_soccer.world.state import IMAGE_AGE_MAX, SIGHT_AGE_MAX
from robot_core.types import STANDSTILL
from sim_bridge.cameras.camera import CameraImage

AFFECTED = 0
"""Index of the player that the fault strikes: number 1 of team red."""
BLIND_GRACE = 1.0
"""[s] for which a robot may walk on after it should have noticed that it sees nothing."""
STALE = 1.5
"""[s] Age of an image from which on it shows nothing of the present."""
IDLE_MAX = 25.0
"""[s] for which no robot of the team may move in play, without a remark that names the fault."""
STOP_TIME = 3.0
"""[s] at the end, in which a robot that has stopped stands."""

Arrivals = Iterable[Delivery[Percepts]]
"""Percepts that reach a player, at once or later."""


class SoccerFault(Fault):
    """A disturbance on the ways to one player. This base class disturbs nothing.

    Attributes:
        rendered: The fault is one of images, so vision sees rendered ones. Other robots than the
            struck one then see nothing, and stand.
    """

    end = 50.0
    rendered = False
    robots = 2

    def _draw(self, random: np.random.Generator) -> None:
        self.begin = float(random.uniform(10.0, 30.0))

    def before_frame(self, harness: "SoccerHarness") -> None:
        """Disturb processes; called a few times per second."""

    def on_image(
        self, harness: "SoccerHarness", camera: str, newest: CameraImage
    ) -> CameraImage | None:
        """What vision gets of the newest image of a camera, in each control period."""
        return newest

    def on_percepts(self, harness: "SoccerHarness", percepts: Percepts) -> Arrivals:
        """What arrives of the percepts of one image."""
        yield Delivery(0, percepts)

    def on_team_message(self, harness: "SoccerHarness", data: bytes) -> Iterable[bytes]:
        """What arrives of a message of the team mate."""
        yield data

    def on_referee_message(self, harness: "SoccerHarness", data: bytes) -> Iterable[bytes]:
        """What arrives of a message of the referee."""
        yield data


class SoccerHarness(Channels):
    """Plays a match in which the fault strikes one player.

    Attributes:
        explained: Remarks of the struck player, in the order of their first appearance.
    """

    def __init__(self, spec: MatchSpec, fault: SoccerFault) -> None:
        self.fault = fault
        self.violations: dict[str, str] = {}
        self.explained: dict[str, None] = {}
        self._now = 0.0
        self._saw = 0.0
        self._saw_image = 0.0
        self._moved = 0.0
        self._stands: deque[bool] = deque(maxlen=round(STOP_TIME / 0.2))
        self.match = Match(spec, rendered=fault.rendered, channels=self)
        for robot in self.match.pitch.world.robots[AFFECTED + 1 :]:
            for camera in robot.cameras:
                camera.enabled = False  # rendering takes most of the time

    # -- what a fault may do -----------------------------------------------------------------------

    def seconds(self) -> float:
        """Time since the start [s]."""
        return self._now

    def kill_player(self) -> None:
        """End the process of the struck player at once."""
        self._player.runs = False

    def start_player(self) -> None:
        """Start the process of the struck player anew."""
        self.match.pitch.restart_player(AFFECTED)

    # -- ways --------------------------------------------------------------------------------------

    def image(self, index: int, camera: str, newest: CameraImage) -> CameraImage | None:
        """See `Channels`."""
        return self.fault.on_image(self, camera, newest) if index == AFFECTED else newest

    def eyes(self, index: int, eyes: Eyes) -> Eyes:
        """See `Channels`."""
        return _FaultyEyes(self, eyes) if index == AFFECTED else eyes

    def team_message(self, index: int, data: bytes) -> Sequence[bytes]:
        """See `Channels`."""
        return tuple(self.fault.on_team_message(self, data)) if index == AFFECTED else (data,)

    def referee_message(self, index: int, data: bytes, time: float) -> Sequence[bytes]:
        """See `Channels`."""
        return tuple(self.fault.on_referee_message(self, data)) if index == AFFECTED else (data,)

    def note_percepts(self, now: float, percepts: Percepts) -> None:
        """Keep what has reached the struck player at `now` [s]."""
        if not 0.0 <= now - percepts.stamp * 1e-9 < STALE:
            return
        self._saw_image = now
        if percepts.ball is not None or percepts.objects or len(percepts.line_points):
            self._saw = now

    # -- the match ---------------------------------------------------------------------------------

    def run(self) -> None:
        """Play to the end of the run."""
        for frame in self.match.play():
            self._now = frame.time
            self.fault.before_frame(self)
            self._check(frame)
            if frame.time >= self.fault.end:
                return

    def close(self) -> None:
        """Release the world."""
        self.match.pitch.world.close()

    @property
    def stopped(self) -> bool:
        """The struck robot stands still at the end, and its remark names the fault."""
        return all(self._stands) and self.fault.explained_by(self._player.player.remark)

    @property
    def _player(self) -> RobotPlayer:
        return self.match.pitch.players[AFFECTED]

    def violate(self, kind: str, evidence: str) -> None:
        """Record a violation; only the first of each kind is kept."""
        self.violations.setdefault(kind, f"{self._now:.1f} s: {evidence}")

    def _check(self, frame: Snapshot) -> None:
        players = self.match.pitch.players
        for player in players:
            self._check_walk(player)
        player = self._player
        name = self.match.pitch.scene.robots[AFFECTED].name
        upright = frame.robots[name].state in ("stand", "walk", "stop")
        walks = self._walks(player)
        self._stands.append(not walks)
        if player.runs and player.player.remark and self._now >= self.fault.begin:
            self.explained[player.player.remark.partition(" for ")[0]] = None
        self._check_blind(walks, upright and player.runs)
        self._check_silent_stop(frame)

    def _walks(self, player: RobotPlayer) -> bool:
        decision = player.decision
        return player.runs and decision is not None and decision.action.walk != STANDSTILL

    def _check_walk(self, player: RobotPlayer) -> None:
        if player.decision is None:
            return
        walk = player.decision.action.walk
        numbers = (walk.x, walk.y, walk.yaw)
        if not all(map(math.isfinite, numbers)) or math.hypot(walk.x, walk.y) > 1.0:
            self.violate("command", f"walk {numbers}")

    def _check_blind(self, walks: bool, looks: bool) -> None:
        """A robot that sees nothing must not walk on."""
        if not looks:
            self._saw = self._saw_image = self._now  # it may look for as long once it is up
        for saw, longest in ((self._saw_image, IMAGE_AGE_MAX), (self._saw, SIGHT_AGE_MAX)):
            since = self._now - saw
            if walks and since > longest + STALE + BLIND_GRACE:
                self.violate("walks blind", f"has seen nothing for {since:.1f} s")

    def _check_silent_stop(self, frame: Snapshot) -> None:
        team = self.match.pitch.scene.robots[AFFECTED].team
        mates = [
            player
            for robot, player in zip(
                self.match.pitch.scene.robots, self.match.pitch.players, strict=True
            )
            if robot.team == team and player.runs
        ]
        playing = frame.phase == Phase.PLAYING
        says = any(self.fault.explained_by(player.player.remark) for player in mates)
        if not playing or says or not mates or any(map(self._walks, mates)):
            self._moved = self._now
        elif self._now - self._moved > IDLE_MAX:
            self.violate("silent stop", f"nobody of {team} has moved since {self._moved:.1f} s")


class _FaultyEyes:
    """Eyes whose percepts go through the fault."""

    def __init__(self, harness: SoccerHarness, eyes: Eyes) -> None:
        self._harness, self._eyes = harness, eyes
        self._coming: Channel[Percepts] = Channel()

    def arrived(self, sight: Sight) -> list[Percepts]:
        """See `Eyes`."""
        tick = round(sight.time * 1e-9 / PERIOD)
        for percepts in self._eyes.arrived(sight):
            for delay, changed in self._harness.fault.on_percepts(self._harness, percepts):
                self._coming.send(tick + delay, changed)
        found = self._coming.receive(tick)
        for percepts in found:
            self._harness.note_percepts(sight.time * 1e-9, percepts)
        return found
