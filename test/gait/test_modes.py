"""The state machine without a robot: each transition has its cause, and no other one happens."""

import contextlib
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nao_lipm_gait.modes import (
    TRANSITIONS,
    UPRIGHT_TIME,
    ModeInputs,
    Modes,
    Requests,
    TippingCom,
    Transition,
)
from nao_lipm_gait.motion.scheduler import ATTEMPTS, GET_UP, MotionScheduler
from nao_lipm_gait.parameters import GaitParameters
from robot_core.errors import NaoGaitError
from robot_core.motion.keyframes import Interpolation, Keyframe, Motion, Posture
from robot_core.motion.library import MotionLibrary
from robot_core.robot import load_robot
from robot_core.types import (
    FALLEN,
    GETTING_UP,
    IN_MOTION,
    MOTION,
    RELAXED,
    STAND,
    STANDSTILL,
    STOP,
    WALK,
    GaitState,
    VelocityCommand,
)
from sim_bridge.trials.trial import Push, TimedCommands, TrialSpec, make_gait, make_world, run

ROBOT = load_robot()
POSE = np.zeros(len(ROBOT.joint_names))
DT = 0.01
FORWARD = VelocityCommand(0.1, 0.0, 0.0)
MOTION_TICKS = 50


def motion(name: str, starts: Posture, ends: Posture) -> Motion:
    """A motion of half a second that leaves all joints where they are."""
    keyframe = Keyframe("pose", POSE, MOTION_TICKS * DT, Interpolation.LINEAR, POSE, 0)
    return Motion(name, name, starts, ends, (keyframe,))


NOD = motion("nod", Posture.STANDING, Posture.STANDING)
SIT = motion("sit", Posture.STANDING, Posture.SITTING)
RISE = motion("rise", Posture.SITTING, Posture.STANDING)
LIE_DOWN = motion("lie_down", Posture.STANDING, Posture.LYING_BACK)
UP_FRONT = motion("up_front", Posture.LYING_FRONT, Posture.STANDING)
ROLL_OVER = motion("roll_over", Posture.LYING_LEFT, Posture.LYING_FRONT)
MOTIONS = (NOD, SIT, RISE, LIE_DOWN, UP_FRONT, ROLL_OVER)


@dataclass
class Robot:
    """What the state estimator would say."""

    tilt: float = 0.0
    lying_side: Posture | None = None
    falls: bool = False
    tipping_com: TippingCom | None = None
    lies: bool = False

    def detect_fall(self) -> bool:
        return self.falls

    def detect_tipping(self) -> TippingCom | None:
        return self.tipping_com

    def lies_after_motion(self) -> bool:
        return self.lies


@dataclass
class Walk:
    """Progress of a walk."""

    finished: bool = False
    stopping: bool = False


class Machine:
    """The modes with a robot and a walk that the test controls."""

    def __init__(self, *, gets_up: bool = False) -> None:
        self.robot, self.walk, self.requests = Robot(), Walk(), Requests()
        self.gets_up = gets_up
        self.modes = self._modes()
        self.modes.begin(lies=False, upright=True)

    def _modes(self) -> Modes:
        motions = MotionScheduler(ROBOT, MotionLibrary(MOTIONS))
        return Modes(self.requests, motions, self.robot, self.walk)

    @property
    def state(self) -> GaitState:
        return self.modes.state

    def restart(
        self, *, lies: bool = False, upright: bool = False, moved: bool = False
    ) -> None:
        """A gap in the frames; lies: the first frame after it shows a robot that lies."""
        before, self.modes = self.modes, self._modes()
        self.modes.continue_from(before, moved=moved)
        self.modes.begin(lies=lies, upright=upright)

    def request(self, name: str) -> None:
        self.modes.motions.request(name, self.modes.next_posture)

    def tick(
        self, command: VelocityCommand = STANDSTILL, *, settled: bool = True
    ) -> Transition | None:
        transition = self.modes.update(ModeInputs(command, settled, self.gets_up, DT))
        if transition is not None and transition.after in IN_MOTION:
            assert transition.motion is not None
            self.modes.motions.begin(transition.motion, POSE, POSE)
        if self.state in IN_MOTION:
            self.modes.motions.advance(DT, (0.0, 0.0, 0.0))
        return transition

    def states(self, ticks: int, command: VelocityCommand = STANDSTILL) -> list[GaitState]:
        """The modes of these ticks, each named when it begins."""
        found: list[GaitState] = []
        for _ in range(ticks):
            self.tick(command)
            if not found or found[-1] is not self.state:
                found.append(self.state)
        return found


def walking() -> Machine:
    machine = Machine()
    machine.tick(FORWARD)
    assert machine.state is WALK
    return machine


def lying(*, gets_up: bool = False) -> Machine:
    """A fallen robot that has not come to rest yet."""
    machine = Machine(gets_up=gets_up)
    machine.robot.falls = True
    machine.robot.tilt = 1.5
    machine.tick()
    assert machine.state is FALLEN
    return machine


def sitting() -> Machine:
    machine = Machine()
    machine.request("sit")
    assert machine.states(2 * MOTION_TICKS) == [MOTION]
    return machine


# -- walking ---------------------------------------------------------------------------------------


def test_a_command_starts_a_walk_and_its_end_is_a_stand() -> None:
    machine = Machine()
    assert machine.tick() is None
    assert machine.tick(FORWARD) == Transition(STAND, WALK)
    assert machine.tick(FORWARD) is None
    machine.walk.stopping = True
    assert machine.tick() == Transition(WALK, STOP)
    machine.walk.stopping = False
    assert machine.tick(FORWARD) == Transition(STOP, WALK)
    machine.walk.finished = True
    assert machine.tick() == Transition(WALK, STAND)


def test_no_walk_begins_before_the_stand_is_reached() -> None:
    machine = Machine()
    assert machine.tick(FORWARD, settled=False) is None
    assert machine.tick(FORWARD) == Transition(STAND, WALK)


def test_a_stand_that_tips_takes_a_capture_step() -> None:
    machine = Machine()
    machine.robot.tipping_com = (0.01, 0.0, 0.3, 0.0)
    assert machine.tick(settled=False) is None
    assert machine.tick() == Transition(STAND, WALK, tipping_com=(0.01, 0.0, 0.3, 0.0))


def test_a_requested_stand_holds_until_the_walk_has_ended() -> None:
    machine = walking()
    machine.requests.stand = True
    machine.tick(FORWARD)
    assert machine.modes.must_stop
    machine.walk.finished = True
    assert machine.tick(FORWARD) == Transition(WALK, STAND)
    assert not machine.modes.must_stop


# -- limp modes ------------------------------------------------------------------------------------


@pytest.mark.parametrize("state", list(GaitState))
def test_a_relax_request_is_served_in_every_mode(state: GaitState) -> None:
    machine = Machine()
    machine.modes.state = state
    machine.requests.relax = True
    transition = machine.tick()
    assert transition is not None
    assert transition.after is RELAXED
    assert not machine.requests.relax


def test_a_relaxed_robot_stands_on_request_only() -> None:
    machine = Machine(gets_up=True)
    machine.requests.relax = True
    machine.tick()
    machine.robot.lying_side = Posture.LYING_FRONT
    assert machine.states(200, FORWARD) == [RELAXED]
    machine.requests.stand = True
    assert machine.tick() == Transition(RELAXED, STAND)


def test_a_relaxed_robot_that_lies_waits_until_it_is_upright() -> None:
    machine = Machine()
    machine.requests.relax = True
    machine.tick()
    machine.robot.falls = True
    machine.requests.stand = True
    assert machine.tick() == Transition(RELAXED, FALLEN)
    machine.robot.falls = False
    assert machine.states(round(2 * UPRIGHT_TIME / DT)) == [FALLEN, STAND]


@pytest.mark.parametrize("reported", [True, False])
def test_a_fall_is_detected_or_reported(reported: bool) -> None:
    machine = walking()
    machine.requests.fall, machine.robot.falls = reported, not reported
    assert machine.tick() == Transition(WALK, FALLEN)
    assert machine.modes.fell
    machine.robot.falls = False
    machine.tick()
    assert not machine.modes.fell
    assert not machine.requests.fall


def test_a_fallen_robot_must_stay_upright_for_some_time() -> None:
    machine = lying()
    machine.robot.falls = False
    machine.robot.tilt = 0.0
    machine.states(round(0.8 * UPRIGHT_TIME / DT))
    machine.robot.tilt = 0.5
    machine.tick()
    machine.robot.tilt = 0.0
    assert machine.states(round(0.8 * UPRIGHT_TIME / DT)) == [FALLEN]
    assert machine.states(round(0.4 * UPRIGHT_TIME / DT))[-1] is STAND


# -- motions ---------------------------------------------------------------------------------------


def test_a_motion_waits_for_the_stand() -> None:
    machine = walking()
    machine.request("nod")
    machine.tick(FORWARD)
    assert machine.modes.must_stop
    machine.walk.finished = True
    assert machine.states(MOTION_TICKS + 3, FORWARD) == [STAND, MOTION, STAND, WALK]


def test_the_stand_after_a_motion_knows_which_motion_has_ended() -> None:
    machine = Machine()
    machine.request("nod")
    machine.states(MOTION_TICKS)
    assert machine.tick() == Transition(MOTION, STAND, NOD)


def test_a_sitting_robot_rises_on_request() -> None:
    machine = sitting()
    assert machine.states(100, FORWARD) == [MOTION]
    assert machine.modes.next_posture is Posture.SITTING
    with pytest.raises(NaoGaitError, match="nod, which starts standing"):
        machine.request("nod")
    machine.requests.stand = True
    assert machine.tick() == Transition(MOTION, MOTION, RISE)
    assert machine.states(2 * MOTION_TICKS) == [MOTION, STAND]


def test_a_motion_to_the_floor_is_no_fall_and_ends_relaxed() -> None:
    machine = Machine(gets_up=True)
    machine.request("lie_down")
    machine.robot.falls = True
    machine.tick()  # the fall of a standing robot comes before its motion
    assert machine.state is FALLEN
    machine = Machine(gets_up=True)
    machine.request("lie_down")
    machine.tick()
    machine.robot.falls = True
    assert machine.states(2 * MOTION_TICKS) == [MOTION, RELAXED]
    machine.robot.lying_side = Posture.LYING_FRONT
    assert machine.states(100) == [RELAXED]


def test_a_stand_requested_on_the_way_to_the_floor_is_not_lost() -> None:
    machine = Machine(gets_up=True)
    machine.request("lie_down")
    machine.tick()
    machine.robot.falls = True
    machine.requests.stand = True
    machine.robot.lying_side = Posture.LYING_FRONT
    states = machine.states(3 * MOTION_TICKS)
    assert states[:4] == [MOTION, RELAXED, FALLEN, GETTING_UP]


def test_a_relax_request_cancels_a_stand_that_waits_for_a_motion() -> None:
    machine = Machine(gets_up=True)
    machine.request("lie_down")
    machine.tick()
    machine.requests.stand = True
    assert machine.states(3) == [MOTION]
    machine.requests.relax = True
    assert machine.states(200) == [RELAXED]


def test_a_fall_drops_the_motions_that_need_feet() -> None:
    machine = walking()
    machine.request("nod")
    machine.robot.falls = True
    machine.tick()
    assert machine.modes.motions.waiting is None


# -- getting up ------------------------------------------------------------------------------------


def test_a_robot_gets_up_from_its_side_once_it_is_at_rest() -> None:
    machine = lying(gets_up=True)
    assert machine.states(100) == [FALLEN]
    machine.robot.lying_side = Posture.LYING_LEFT
    assert machine.tick() == Transition(FALLEN, GETTING_UP, ROLL_OVER)
    machine.robot.lying_side = Posture.LYING_FRONT
    assert machine.states(MOTION_TICKS) == [GETTING_UP, FALLEN]
    assert machine.tick() == Transition(FALLEN, GETTING_UP, UP_FRONT)
    machine.robot.falls = False
    assert machine.states(2 * MOTION_TICKS) == [GETTING_UP, STAND]


def test_a_fall_that_is_reported_during_a_get_up_does_not_fell_the_robot_that_stands() -> None:
    machine = lying(gets_up=True)
    machine.robot.lying_side = Posture.LYING_FRONT
    machine.requests.fall = True
    assert machine.tick() == Transition(FALLEN, GETTING_UP, UP_FRONT)
    machine.robot.falls = False
    machine.requests.fall = True
    assert machine.states(2 * MOTION_TICKS) == [GETTING_UP, STAND]


def test_a_get_up_that_fails_is_repeated_a_few_times() -> None:
    machine = lying(gets_up=True)
    machine.robot.lying_side = Posture.LYING_FRONT
    machine.robot.lies = True
    states = machine.states(20 * MOTION_TICKS)
    assert states.count(GETTING_UP) == ATTEMPTS
    assert states[-1] is FALLEN
    machine.request(GET_UP)
    assert machine.states(2)[-1] is GETTING_UP


def test_a_side_without_a_motion_ends_the_request_and_costs_no_attempt() -> None:
    machine = lying(gets_up=True)
    machine.robot.lying_side = Posture.LYING_BACK
    machine.request(GET_UP)
    assert machine.states(2 * ATTEMPTS) == [FALLEN]
    assert not machine.modes.motions.get_up_wanted
    machine.robot.lying_side = Posture.LYING_FRONT
    assert machine.tick() == Transition(FALLEN, GETTING_UP, UP_FRONT)


def test_a_stand_firm_enough_for_a_motion_gives_all_attempts_back() -> None:
    machine = lying(gets_up=True)
    machine.robot.lying_side = Posture.LYING_FRONT
    for _ in range(ATTEMPTS + 1):
        machine.robot.falls = False
        assert machine.states(2 * MOTION_TICKS)[-1] is STAND
        machine.request("nod")
        assert machine.states(2 * MOTION_TICKS) == [MOTION, STAND]
        machine.robot.falls = True
        assert machine.tick() == Transition(STAND, FALLEN)


def test_without_the_parameter_it_gets_up_on_request() -> None:
    machine = lying()
    machine.robot.lying_side = Posture.LYING_FRONT
    assert machine.states(100) == [FALLEN]
    machine.request(GET_UP)
    assert machine.tick() == Transition(FALLEN, GETTING_UP, UP_FRONT)


# -- restarts --------------------------------------------------------------------------------------


def test_limp_fallen_and_sitting_robots_outlast_a_restart() -> None:
    machine = Machine()
    machine.requests.relax = True
    machine.tick()
    machine.restart()
    assert machine.states(10) == [RELAXED]

    machine = lying()
    machine.robot.falls = False
    machine.restart()
    assert machine.states(10) == [FALLEN]

    machine = sitting()
    machine.restart()
    assert machine.states(10) == [MOTION]
    machine.restart(lies=True)
    assert machine.states(10) == [FALLEN]


def test_a_get_up_is_begun_again_after_a_restart() -> None:
    machine = lying()
    machine.robot.lying_side = Posture.LYING_FRONT
    machine.request(GET_UP)
    assert machine.states(10) == [GETTING_UP]
    machine.restart()
    assert machine.states(10) == [GETTING_UP]


@pytest.mark.parametrize("walks", [True, False])
def test_a_walking_or_standing_robot_stands_after_a_restart(walks: bool) -> None:
    machine = walking() if walks else Machine()
    machine.restart()
    assert machine.states(10) == [STAND]


# -- all together ----------------------------------------------------------------------------------

EVENTS = (
    "stand", "relax", "fall", "nod", "sit", "rise", "lie_down", "up_front", GET_UP, "walk",
    "halt", "stopping", "finished", "falls", "upright", "at_rest", "tips", "lies", "restart",
)  # fmt: skip


def happen(machine: Machine, event: str) -> None:
    """Let one event happen; a motion that cannot begin is refused."""
    robot, walk, requests = machine.robot, machine.walk, machine.requests
    if event in ("stand", "relax", "fall"):
        setattr(requests, event, True)
    elif event in ("stopping", "finished"):
        setattr(walk, event, not getattr(walk, event))
    elif event == "falls":
        robot.falls, robot.tilt = True, 1.0
    elif event == "upright":
        robot.falls, robot.tilt, robot.lies, robot.lying_side = False, 0.0, False, None
    elif event == "at_rest":
        robot.lying_side = Posture.LYING_FRONT
    elif event == "tips":
        robot.tipping_com = None if robot.tipping_com else (0.0, 0.0, 0.3, 0.0)
    elif event == "lies":
        robot.lies = True
    elif event == "restart":
        machine.restart()
    elif event not in ("walk", "halt"):
        with contextlib.suppress(NaoGaitError):
            machine.request(event)


@settings(max_examples=300)
@given(
    events=st.lists(st.tuples(st.sampled_from(EVENTS), st.sampled_from((1, 5, 60))), max_size=40),
    gets_up=st.booleans(),
)
def test_every_transition_is_in_the_table_and_every_motion_fits(
    events: list[tuple[str, int]], gets_up: bool
) -> None:
    machine = Machine(gets_up=gets_up)
    command = STANDSTILL
    for event, ticks in events:
        happen(machine, event)
        command = {"walk": FORWARD, "halt": STANDSTILL}.get(event, command)
        for _ in range(ticks):
            before = machine.state
            transition = machine.tick(command)
            if transition is None:
                assert machine.state is before
                continue
            assert (transition.before, transition.after) == (before, machine.state)
            assert machine.state in {after for after, _ in TRANSITIONS[before]}
            if transition.after in IN_MOTION:
                assert transition.motion is not None
                # A lying robot begins no motion that needs feet, and no get-up begins on feet.
                assert transition.motion.gets_up == (transition.after is GETTING_UP)


@pytest.mark.parametrize(
    ("moved", "lies", "upright", "state"),
    [(True, False, True, STAND), (True, False, False, FALLEN), (True, True, False, FALLEN),
     (False, False, True, FALLEN)],
)  # fmt: skip
def test_a_fallen_robot_that_is_put_on_its_feet_in_a_pause_stands_at_once(
    moved: bool, lies: bool, upright: bool, state: GaitState
) -> None:
    machine = Machine()
    machine.requests.fall = True
    assert machine.states(1) == [FALLEN]
    machine.restart(moved=moved, lies=lies, upright=upright)
    assert machine.state is state
    assert machine.states(1) == [state]


def test_a_simulated_robot_changes_modes_by_the_table() -> None:
    """It walks, sits down, rises, walks, is pushed over, gets up, walks on and is relaxed."""
    pytest.importorskip("mujoco")
    spec = TrialSpec(engine="mujoco", parameters=GaitParameters(get_up=True))
    gait = make_gait(spec)
    requests = {
        4.0: lambda: gait.request_motion("sit"),
        12.0: gait.request_stand,
        35.0: gait.request_relax,
    }
    walk = TimedCommands(lambda time: FORWARD, [Push(18.0, 12.0, 0.0)], ahead=False)
    states = [STAND]
    with make_world(spec) as world:
        for number, tick in enumerate(run(world, gait, walk, past_falls=True)):
            if number == 3600:
                break
            requests.get(round(0.01 * number, 2), lambda: None)()
            state = states[-1] if tick.status is None else tick.status.state
            if state is not states[-1]:
                assert state in {after for after, _ in TRANSITIONS[states[-1]]}
                states.append(state)
    rising = [MOTION, STAND, WALK]
    assert states[:7] == [STAND, WALK, STOP, STAND, *rising]
    assert states[7:9] == [FALLEN, GETTING_UP]
    assert states[-3:] == [STAND, WALK, RELAXED]


def test_feet_that_must_be_set_down_end_a_walk_at_once_and_take_no_step() -> None:
    machine = walking()
    machine.requests.set_down = True
    machine.tick(FORWARD)
    assert machine.state is STAND
    machine.robot.tipping_com = (0.1, 0.0, 0.0, 0.0)
    machine.requests.set_down = True
    machine.tick()
    assert machine.state is STAND
    machine.tick()
    assert machine.state is WALK  # nothing forbids the step any more
