"""The state machine of the gait: stand, walk, stop, lifted, motion, getting_up, fallen, relaxed.

`TRANSITIONS`, at the end of this file, lists for each mode the modes that may follow and their
conditions. The conditions are short methods of `Modes`. `Modes` only decides; the gait carries out
what a transition needs: it begins a stand, a walk or a motion.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from nao_lipm_gait.estimation.state_estimator import UPRIGHT_TILT
from nao_lipm_gait.motion.scheduler import ATTEMPTS, MotionScheduler
from robot_core.motion.keyframes import LYING, Motion, Posture
from robot_core.types import (
    BUSY,
    DOWN,
    FALLEN,
    GETTING_UP,
    IN_MOTION,
    LIFTED,
    MOTION,
    RELAXED,
    STAND,
    STOP,
    WALK,
    GaitState,
    VelocityCommand,
)

UPRIGHT_TIME = 0.5
"""Time [s] for which the tilt must stay below it before the robot stands up."""

TippingCom = tuple[float, float, float, float]
"""CoM of a tipping stand relative to its rest position: x, y [m], vx, vy [m/s]."""


@dataclass(slots=True)
class Requests:
    """Requests from outside, each valid until a tick has served it.

    Requested motions, get-ups included, wait in the `MotionScheduler`.

    Attributes:
        stand: Stop walking, or leave a sitting or relaxed pose, and stand.
        relax: Take the torque off all joints.
        fall: Another sensor has detected a fall.
        set_down: Put both feet down at once, and take no step.
    """

    stand: bool = False
    relax: bool = False
    fall: bool = False
    set_down: bool = False


class ModeInputs(NamedTuple):
    """What the modes depend on in one tick, besides the robot and the walk.

    Attributes:
        gets_up: A fallen robot gets up without a request.
        dt: Time [s] since the last tick.
        lifted: See `SensorFrame`.
    """

    command: VelocityCommand
    settled: bool
    gets_up: bool
    dt: float
    lifted: bool = False


class Transition(NamedTuple):
    """A change of mode.

    Attributes:
        before: Mode until this tick.
        after: Mode from this tick on.
        motion: Motion to begin, or for `stand` the motion that has ended.
        tipping_com: CoM from which a capture step begins, for `walk`.
    """

    before: GaitState
    after: GaitState
    motion: Motion | None = None
    tipping_com: TippingCom | None = None


class RobotState(Protocol):
    """What the modes need from the state estimator; each method is called at most once per tick."""

    @property
    def tilt(self) -> float:
        """Angle [rad] between the torso's z axis and the vertical."""

    @property
    def lying_side(self) -> Posture | None:
        """Side on which the robot has come to rest; None while it moves or is upright."""

    def detect_fall(self) -> bool:
        """Whether a fall can no longer be prevented."""

    def detect_tipping(self) -> TippingCom | None:
        """CoM of a stand that tips; None while it does not."""

    def lies_after_motion(self) -> bool:
        """Whether a get-up has failed."""


class WalkProgress(Protocol):
    """What the modes need from the walk."""

    @property
    def finished(self) -> bool:
        """The CoM has come to rest between the feet."""

    @property
    def stopping(self) -> bool:
        """Both feet stay on the ground."""


class Modes:
    """Decides once per tick which mode the gait is in.

    Args:
        requests: Requests from outside; they outlast a reset.
        motions: Running and requested motions.
        robot: State of the robot.
        walk: Progress of the walk.

    Attributes:
        fell: A fall was detected in the last tick.
        resumes: The first frame continues the motion pose that was held before a restart.
        put_up: A fall before a restart is over if the first frame shows a robot that stands.
    """

    def __init__(
        self,
        requests: Requests,
        motions: MotionScheduler,
        robot: RobotState,
        walk: WalkProgress,
    ) -> None:
        self.state: GaitState = STAND
        self.fell = False
        self.resumes = False
        self.put_up = False
        self.motions = motions
        self._requests = requests
        self._robot = robot
        self._walk = walk
        self._upright_time = 0.0
        self._now = ModeInputs(VelocityCommand(), False, False, 0.0)

    # -- before the first frame --------------------------------------------------------------------

    def continue_from(self, before: "Modes", *, moved: bool) -> None:
        """Keep what outlasts a restart of the gait.

        A relaxed robot stays relaxed, a fallen one stays fallen and continues to get up, and a held
        motion pose, such as sitting, is held further.

        Args:
            before: Modes until the restart.
            moved: The robot may have been put elsewhere meanwhile, and on its feet.
        """
        self.put_up = moved or before.put_up
        if before.state is RELAXED:
            self._requests.relax = True
        elif self._requests.fall or before.state in (FALLEN, GETTING_UP):
            self._requests.fall = True
            self.motions.get_up_wanted = before.motions.get_up_wanted
        elif before.resumes or (before.state is MOTION and before.motions.finished):
            self.motions = before.motions
            self.resumes = True

    def begin(self, *, lies: bool, upright: bool) -> None:
        """The first frame has arrived; it shows a robot that lies, that is upright, or neither."""
        resumes, self.resumes = self.resumes, False
        put_up, self.put_up = self.put_up, False
        if upright and put_up:
            self._requests.fall = False
        if lies or self._requests.fall:
            self.state = FALLEN
            self.motions.drop_upright()
        else:
            self.state = MOTION if resumes else STAND
            self.motions.get_up_wanted = False

    # -- the tick ----------------------------------------------------------------------------------

    def update(self, now: ModeInputs) -> Transition | None:
        """Apply the first transition of the current mode whose condition holds, if any."""
        self._now = now
        self.fell = False
        transition = self._first_transition()
        if transition is not None:
            self._enter(transition)
        # A motion has just ended on the floor: the relaxed robot has still to serve a stand.
        entered = transition is not None and transition.after is RELAXED
        if self.state not in BUSY and (self._requests.relax or not entered):
            self._requests.stand = False
        self._requests.relax = self._requests.fall = self._requests.set_down = False
        return transition

    def _first_transition(self) -> Transition | None:
        before = self.state
        for after, condition in TRANSITIONS[before]:
            cause = condition(self)
            if cause:
                motion = cause if isinstance(cause, Motion) else None
                com: TippingCom | None = cause if isinstance(cause, tuple) else None
                return Transition(before, after, motion, com)
        return None

    def _enter(self, transition: Transition) -> None:
        before, after = transition.before, transition.after
        if after in (FALLEN, LIFTED) or (after is RELAXED and not self._requests.relax):
            self.motions.drop_upright()
        elif after is RELAXED or (after is STAND and before not in (WALK, STOP)):
            self.motions.stop()
        elif before is STAND and after in (WALK, MOTION) and transition.tipping_com is None:
            self.motions.attempts = 0  # it stood firmly
        self._upright_time = 0.0
        self.state = after

    # -- what the gait asks ------------------------------------------------------------------------

    @property
    def must_stop(self) -> bool:
        """A stand is requested, or a motion waits for one."""
        return self._requests.stand or self.motions.waiting is not None

    @property
    def next_posture(self) -> Posture | None:
        """Posture of the robot once the running motion has ended; None while it is unknown."""
        running = self.motions.running
        if self.state in IN_MOTION and running is not None:
            return running.ends
        return self._robot.lying_side if self.state in DOWN else Posture.STANDING

    # -- conditions: falsy, or the cause of the transition -----------------------------------------

    def _relax_requested(self) -> bool:
        return self._requests.relax

    def _stand_requested(self) -> bool:
        return self._requests.stand

    def _falls(self) -> bool:
        falls = self._requests.fall or self._robot.detect_fall()
        running = self.motions.running
        # A motion that ends on the floor tilts the robot on purpose.
        self.fell = falls and (running is None or running.upright)
        return self.fell

    def _falls_and_should_stand(self) -> bool:
        return self._falls() and self._requests.stand

    def _lifted(self) -> bool:
        return self._now.lifted

    def _put_down(self) -> bool:
        return not self._now.lifted

    def _requested_motion(self) -> Motion | None:
        return self.motions.waiting if self._now.settled else None

    def _tips(self) -> TippingCom | None:
        if self._requests.set_down or not self._now.settled:
            return None
        return self._robot.detect_tipping()

    def _walk_commanded(self) -> bool:
        return not self._now.command.is_zero and self._now.settled and not self.must_stop

    def _set_down(self) -> bool:
        return self._requests.set_down

    def _walk_finished(self) -> bool:
        return self._walk.finished

    def _walk_stops(self) -> bool:
        return self._walk.stopping

    def _walk_continues(self) -> bool:
        return not self._walk.stopping

    def _motion_ended_lying(self) -> bool:
        ended = self._ended_motion()
        return ended is not None and ended.ends in LYING

    def _get_up_failed(self) -> bool:
        ended = self._ended_motion()
        return ended is not None and (ended.ends in LYING or self._robot.lies_after_motion())

    def _next_motion(self) -> Motion | None:
        """The requested motion, or the one from a sitting pose to the requested stand."""
        ended = self._ended_motion()
        if ended is None or self.motions.waiting is not None:
            return self.motions.waiting if ended is not None else None
        if ended.ends is Posture.STANDING or not self._requests.stand:
            return None
        return self.motions.library.between(ended.ends, Posture.STANDING)

    def _motion_ended_standing(self) -> Motion | None:
        ended = self._ended_motion()
        return ended if ended is not None and ended.ends is Posture.STANDING else None

    def _ended_motion(self) -> Motion | None:
        return self.motions.running if self.motions.finished else None

    def _get_up(self) -> Motion | None:
        """The requested motion, or a get-up from the side on which the robot lies."""
        motions, side = self.motions, self._robot.lying_side
        if motions.waiting is not None:
            return motions.waiting
        # A robot that was relaxed on purpose gets up on request only.
        wanted = motions.get_up_wanted or (self._now.gets_up and self.state is FALLEN)
        if side is None or not wanted or motions.attempts >= ATTEMPTS:
            return None
        motion = motions.get_up_from(side)
        if motion is None:
            motions.get_up_wanted = False
        else:
            motions.attempts += 1
        return motion

    def _stays_upright(self) -> bool:
        """The robot has been put back on its feet."""
        upright = self._robot.tilt < UPRIGHT_TILT
        self._upright_time = self._upright_time + self._now.dt if upright else 0.0
        return self._upright_time > UPRIGHT_TIME


Condition = Callable[[Modes], Motion | TippingCom | bool | None]

TRANSITIONS: dict[GaitState, tuple[tuple[GaitState, Condition], ...]] = {
    STAND: (
        (RELAXED, Modes._relax_requested),
        (FALLEN, Modes._falls),
        (LIFTED, Modes._lifted),
        (MOTION, Modes._requested_motion),
        (WALK, Modes._tips),
        (WALK, Modes._walk_commanded),
    ),
    WALK: (
        (RELAXED, Modes._relax_requested),
        (FALLEN, Modes._falls),
        (LIFTED, Modes._lifted),
        (STAND, Modes._set_down),
        (STAND, Modes._walk_finished),
        (STOP, Modes._walk_stops),
    ),
    STOP: (
        (RELAXED, Modes._relax_requested),
        (FALLEN, Modes._falls),
        (LIFTED, Modes._lifted),
        (STAND, Modes._walk_finished),
        (WALK, Modes._walk_continues),
    ),
    LIFTED: (
        (RELAXED, Modes._relax_requested),
        (FALLEN, Modes._falls),
        (STAND, Modes._put_down),
    ),
    MOTION: (
        (RELAXED, Modes._relax_requested),
        (FALLEN, Modes._falls),
        (RELAXED, Modes._motion_ended_lying),
        (MOTION, Modes._next_motion),
        (STAND, Modes._motion_ended_standing),
    ),
    GETTING_UP: (
        (RELAXED, Modes._relax_requested),
        (FALLEN, Modes._get_up_failed),
        (MOTION, Modes._next_motion),
        (STAND, Modes._motion_ended_standing),
    ),
    FALLEN: (
        (RELAXED, Modes._relax_requested),
        (GETTING_UP, Modes._get_up),
        (FALLEN, Modes._falls),
        (STAND, Modes._stays_upright),
    ),
    RELAXED: (
        (RELAXED, Modes._relax_requested),
        (GETTING_UP, Modes._get_up),
        (FALLEN, Modes._falls_and_should_stand),
        (STAND, Modes._stand_requested),
    ),
}
"""For each mode its transitions (next mode, condition); the first whose condition holds applies.

A transition of a mode into itself restarts it: the time upright of a fallen robot, or the next
motion.
"""
