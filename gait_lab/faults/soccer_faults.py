"""Faults of cameras, vision, team mates, referee and player, in the middle of a match.

Half of them last to the end of the run; the others are over after some seconds.
"""

import math
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from gait_lab.faults.campaign import STOPPED, VIOLATED, WENT_ON, FaultResult, FaultRun
from gait_lab.faults.harness import PERIOD
from gait_lab.faults.messages import Delivery
from gait_lab.faults.soccer_harness import Arrivals, SoccerFault, SoccerHarness
from gait_lab.soccer.match import MatchSpec
from nao_soccer.vision.percepts import Kind, Percept, Percepts
from sim_bridge.cameras.camera import CameraImage
from sim_bridge.plant import load_plant, with_options

FUTURE = (0.6, 10.0)
"""[s] by which stamps are ahead."""
LATE = (0.3, 3.0)
"""[s] by which images or percepts come later than usual."""
BAD_NUMBERS = (math.nan, math.inf, -math.inf, 1e30, -1e30, -1.0, 0.0)
FLIPS = 4
"""Largest number of changed bits of a message."""
BLIND = ("no usable image", "nothing seen in the images")
"""Remarks of a player that cannot see."""


class LastingFault(SoccerFault):
    """A fault that lasts for some seconds, or to the end of the run."""

    def _draw(self, random: np.random.Generator) -> None:
        super()._draw(random)
        shorter = random.uniform() < 0.5
        self.duration = float(random.uniform(2.0, 15.0)) if shorter else math.inf


# -- cameras ---------------------------------------------------------------------------------------


class CameraFault(LastingFault):
    """A fault of both cameras; one robot against one."""

    rendered = True
    robots = 1
    end = 40.0
    says = BLIND

    def _draw(self, random: np.random.Generator) -> None:
        super()._draw(random)
        self.begin = float(random.uniform(8.0, 20.0))


class CameraBlack(CameraFault):
    """The images are black, with a camera's noise."""

    def on_image(
        self, harness: SoccerHarness, camera: str, newest: CameraImage
    ) -> CameraImage | None:
        """A dark image at the same time."""
        if not self.active(harness):
            return newest
        noise = np.random.default_rng(newest.stamp).integers(0, 6, newest.pixels.shape)
        return newest._replace(pixels=noise.astype(np.uint8))


class CameraFrozen(CameraFault):
    """Each camera repeats its last image with new stamps."""

    def _draw(self, random: np.random.Generator) -> None:
        super()._draw(random)
        self._last: dict[str, CameraImage] = {}

    def on_image(
        self, harness: SoccerHarness, camera: str, newest: CameraImage
    ) -> CameraImage | None:
        """The last image from before, at this time."""
        if not self.active(harness):
            self._last[camera] = newest
        return newest._replace(pixels=self._last.get(camera, newest).pixels)


class CameraLate(CameraFault):
    """Images arrive 0.3 to 3 s late, with their right stamps."""

    def _draw(self, random: np.random.Generator) -> None:
        super()._draw(random)
        self._delay = round(1e9 * float(random.uniform(*LATE)))
        self._queues: dict[str, deque[CameraImage]] = {}

    def on_image(
        self, harness: SoccerHarness, camera: str, newest: CameraImage
    ) -> CameraImage | None:
        """The newest image that is old enough."""
        if not self.active(harness):
            self._queues.clear()
            return newest
        queue = self._queues.setdefault(camera, deque())
        if not queue or queue[-1].stamp != newest.stamp:
            queue.append(newest)
        limit = round(harness.seconds() * 1e9) - self._delay
        while len(queue) > 1 and queue[1].stamp <= limit:
            queue.popleft()
        return queue[0] if queue[0].stamp <= limit else None


# -- percepts --------------------------------------------------------------------------------------


class VisionGone(LastingFault):
    """Vision is killed; in half of the runs it is back after 2 to 15 s."""

    says = BLIND

    def on_percepts(self, harness: SoccerHarness, percepts: Percepts) -> Arrivals:
        """No percepts."""
        if not self.active(harness):
            yield Delivery(0, percepts)


class PerceptsFuture(LastingFault):
    """Stamps of percepts are 0.6 to 10 s ahead, of all or of some."""

    says = BLIND

    def _draw(self, random: np.random.Generator) -> None:
        super()._draw(random)
        self._ahead = round(1e9 * float(random.uniform(*FUTURE)))
        self._share = 1.0 if random.uniform() < 0.5 else float(random.uniform(0.1, 0.9))

    def on_percepts(self, harness: SoccerHarness, percepts: Percepts) -> Arrivals:
        """Percepts of the future."""
        wrong = self.active(harness) and self.random.uniform() < self._share
        ahead = self._ahead if wrong else 0
        yield Delivery(0, replace(percepts, stamp=percepts.stamp + ahead))


class PerceptsLate(LastingFault):
    """Percepts arrive 0.3 to 3 s late."""

    says = BLIND

    def _draw(self, random: np.random.Generator) -> None:
        super()._draw(random)
        self._delay = round(float(random.uniform(*LATE)) / PERIOD)

    def on_percepts(self, harness: SoccerHarness, percepts: Percepts) -> Arrivals:
        """The percepts, later."""
        yield Delivery(self._delay if self.active(harness) else 0, percepts)


class PerceptsNan(LastingFault):
    """10 to 100 % of the percepts have NaN, infinite, huge or negative numbers."""

    says = BLIND

    def _draw(self, random: np.random.Generator) -> None:
        super()._draw(random)
        self._share = float(random.uniform(0.1, 1.0))

    def on_percepts(self, harness: SoccerHarness, percepts: Percepts) -> Arrivals:
        """Some numbers of each object and of the lines are replaced."""
        if not self.active(harness):
            yield Delivery(0, percepts)
            return
        points, covariances = percepts.line_points.copy(), percepts.line_covariances.copy()
        wrong = self.random.uniform(size=len(points)) < self._share
        points[wrong, self.random.integers(2)] = self._bad()
        covariances[wrong, self.random.integers(3)] = self._bad()
        ball = percepts.ball
        if ball is None and self.random.uniform() < 0.2:
            ball = Percept(Kind.BALL, (self._bad(), self._bad()), (0.01, 0.0, 0.01))
        changed = replace(
            percepts,
            ball=None if ball is None else self._spoilt(ball),
            objects=tuple(map(self._spoilt, percepts.objects)),
            line_points=points,
            line_covariances=covariances,
        )
        yield Delivery(0, changed)

    def _spoilt(self, percept: Percept) -> Percept:
        if self.random.uniform() >= self._share:
            return percept
        _, y = percept.position
        xx, xy, yy = percept.covariance
        if self.random.uniform() < 0.5:
            xx = self._bad()
        return percept._replace(position=(self._bad(), y), covariance=(xx, xy, yy), yaw=self._bad())

    def _bad(self) -> float:
        return BAD_NUMBERS[self.random.integers(len(BAD_NUMBERS))]


# -- messages --------------------------------------------------------------------------------------


class MateMute(LastingFault):
    """No message of the team mate arrives."""

    def on_team_message(self, harness: SoccerHarness, data: bytes) -> Iterable[bytes]:
        """Nothing."""
        if not self.active(harness):
            yield data


class MateGarbage(LastingFault):
    """Damaged and random bytes arrive beside the messages of the team mate."""

    def on_team_message(self, harness: SoccerHarness, data: bytes) -> Iterable[bytes]:
        """The message, and others that are none."""
        yield data
        if self.active(harness):
            yield flipped(data, self.random)
            yield self.random.bytes(int(self.random.integers(0, 200)))


class RefereeGone(LastingFault):
    """No message of the referee arrives."""

    says = ("referee not heard",)

    def on_referee_message(self, harness: SoccerHarness, data: bytes) -> Iterable[bytes]:
        """Nothing."""
        if not self.active(harness):
            yield data


class RefereeGarbage(LastingFault):
    """Truncated and random bytes arrive beside the messages of the referee."""

    def on_referee_message(self, harness: SoccerHarness, data: bytes) -> Iterable[bytes]:
        """The message, and others that are none; a changed bit could be a true message."""
        yield data
        if self.active(harness):
            yield data[: int(self.random.integers(len(data)))]
            yield self.random.bytes(int(self.random.integers(0, 400)))


class PlayerRestart(SoccerFault):
    """The player is killed and is back after 1 to 10 s, with its pose of the kick-off."""

    says = ("no referee heard yet",)

    def _draw(self, random: np.random.Generator) -> None:
        super()._draw(random)
        self._back = self.begin + float(random.uniform(1.0, 10.0))
        self._step = 0

    def before_frame(self, harness: SoccerHarness) -> None:
        """Kill the player, and start it again."""
        if self._step == 0 and harness.seconds() >= self.begin:
            self._step = 1
            harness.kill_player()
        elif self._step == 1 and harness.seconds() >= self._back:
            self._step = 2
            harness.start_player()


def flipped(data: bytes, random: np.random.Generator) -> bytes:
    """The bytes with some bits changed."""
    changed = bytearray(data)
    for _ in range(int(random.integers(1, FLIPS + 1))):
        changed[int(random.integers(len(changed)))] ^= 1 << int(random.integers(8))
    return bytes(changed)


SOCCER_FAULTS: Mapping[str, type[SoccerFault]] = {
    "none": SoccerFault,
    "camera_black": CameraBlack,
    "camera_frozen": CameraFrozen,
    "camera_late": CameraLate,
    "vision_gone": VisionGone,
    "percepts_future": PerceptsFuture,
    "percepts_late": PerceptsLate,
    "percepts_nan": PerceptsNan,
    "mate_mute": MateMute,
    "mate_garbage": MateGarbage,
    "referee_gone": RefereeGone,
    "referee_garbage": RefereeGarbage,
    "player_restart": PlayerRestart,
}
"""By their names in the results of `--scope soccer`."""
HALF = 2.0
"""[min] Longer than a run."""


def run_soccer_fault(run: FaultRun) -> FaultResult:
    """Play, inject the fault, and play on to the end of the run."""
    kind = list(SOCCER_FAULTS).index(run.fault)
    fault = SOCCER_FAULTS[run.fault](np.random.default_rng((kind, run.seed)))
    spec = MatchSpec(
        seed=run.seed, robots=fault.robots, minutes=HALF, engine=run.engine, urdf=run.urdf,
        plant=with_options(load_plant(run.plant), run.plant_options), frames=False,
    )  # fmt: skip
    harness = SoccerHarness(spec, fault)
    try:
        harness.run()
    except Exception as error:
        harness.violate("exception", f"{type(error).__name__}: {error}")
    finally:
        harness.close()
    ended = STOPPED if harness.stopped else WENT_ON
    return FaultResult(
        run=run,
        outcome=VIOLATED if harness.violations else ended,
        violations=tuple(f"{kind}: {text}" for kind, text in harness.violations.items()),
        explained=tuple(harness.explained),
    )
