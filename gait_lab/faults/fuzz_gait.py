"""Fuzzing of the gait, and of what the bridge reads of its commands."""

import math
import random
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from hypothesis import strategies as st

from gait_lab.faults.invariants import HANG, CommandCheck
from nao_lipm_gait.parameters import BY_NAME, GaitParameters
from nao_lipm_gait.runtime.controller import ControllerSettings, GaitController, Output
from nao_lipm_gait.runtime.inputs import (
    ImuInput,
    Input,
    JointInput,
    LoadInput,
    TemperatureInput,
    TwistInput,
    head_angles,
    head_follow,
    head_mode,
    head_point,
    kick_goal,
)
from nao_lipm_gait.runtime.reporter import PublisherCounts
from robot_core.command_input import CommandInput, read_push
from robot_core.errors import NaoGaitError
from robot_core.motion.library import shipped_library
from robot_core.robot import load_robot
from robot_core.schema import Field

ROBOT = load_robot()
JOINTS = list(ROBOT.joint_names)
PERIOD = 10_000_000
"""Control period [ns]."""
BAD_SHARE = 0.3
"""Share of the messages that are sent with invalid content too."""
MOTION_FILES = ("x.yaml", "/.yaml", "\u0000.yaml", f"{'x' * 5000}.yaml")
"""Motions that are files, none of which can be read."""

# -- what Hypothesis draws -------------------------------------------------------------------------

NUMBERS = st.one_of(
    st.floats(-3.0, 3.0),
    st.sampled_from((0.0, 1e3, -1e3, 1e9, -1e9, 1e308, -1e308, 5e-324, math.nan, math.inf)),
    st.floats(),
)
PAIRS, TRIPLES, QUATERNIONS = (st.tuples(*[NUMBERS] * size) for size in (2, 3, 4))
TITLES = st.one_of(
    st.sampled_from((*JOINTS, "", "Tail", "\u0000", "%s%n", "../../etc")), st.text(max_size=20)
)
FRAMES = st.one_of(st.sampled_from(("odom", "base_footprint", "torso", "world")), TITLES)
STAMPS = st.tuples(
    st.one_of(st.sampled_from((-(2**31), -1, 0, 1, 2**31 - 1)), st.integers(-(2**31), 2**31 - 1)),
    st.one_of(st.sampled_from((0, 10**9 - 1, 10**9, 2**32 - 1)), st.integers(0, 2**32 - 1)),
)


def _columns(values: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    """Other values at some places of a column, or another column."""
    places = st.dictionaries(st.integers(0, len(JOINTS) - 1), values, min_size=1, max_size=4)
    return st.one_of(places, st.lists(values, max_size=64))


NAMES = st.one_of(st.permutations(JOINTS), _columns(TITLES))
FIELDS: dict[str, dict[str, st.SearchStrategy[Any]]] = {
    "cmd_vel": {"linear": TRIPLES, "angular": TRIPLES},
    "imu/data": {
        "stamp": STAMPS, "angular_velocity": TRIPLES, "linear_acceleration": TRIPLES,
        "orientation": QUATERNIONS, "orientation_covariance": NUMBERS,
        "angular_velocity_covariance": NUMBERS, "linear_acceleration_covariance": NUMBERS,
    },
    "joint_states": {"stamp": STAMPS, "names": NAMES, "position": _columns(NUMBERS)},
    "wrench": {"stamp": STAMPS, "force": NUMBERS},
    "temperature": {"stamp": STAMPS, "joint": TITLES, "degrees": NUMBERS},
    "joint_command": {
        "names": NAMES, "position": _columns(NUMBERS), "effort": _columns(NUMBERS),
    },
    "push": {"force": TRIPLES, "torque": TRIPLES, "frame": FRAMES},
}  # fmt: skip
"""Fields of each topic that may be replaced in a valid message."""


def _values(parameter: Field) -> st.SearchStrategy[Any]:
    bad = st.sampled_from((math.nan, 1e9, "x", None, True))
    if parameter.is_number:
        return st.one_of(st.floats(parameter.minimum, parameter.maximum), bad)
    return st.one_of(st.sampled_from(parameter.choices or (False, True)), bad)


PARAMETERS = st.lists(
    st.sampled_from(sorted(BY_NAME)), min_size=1, max_size=4, unique=True
).flatmap(lambda names: st.fixed_dictionaries({name: _values(BY_NAME[name]) for name in names}))
REQUESTS: dict[str, tuple[st.SearchStrategy[Any], Callable[..., object]]] = {
    "motion": (
        st.tuples(st.one_of(
            st.sampled_from((*shipped_library(ROBOT).motions, *MOTION_FILES)), TITLES
        )), GaitController.request_motion,
    ),
    "head": (
        st.tuples(st.sampled_from((ROBOT.head, ("Tail", "HeadYaw"))), PAIRS),
        lambda gait, names, position: gait.look(head_angles(names, position, ROBOT)),
    ),
    "look_at": (
        st.tuples(TRIPLES, FRAMES),
        lambda gait, point, frame: gait.look(head_point("look_at", point, frame, ROBOT)),
    ),
    "follow": (
        st.tuples(TRIPLES, FRAMES),
        lambda gait, point, frame: gait.look(head_follow(point, frame, ROBOT)),
    ),
    "head_mode": (
        st.tuples(st.one_of(st.sampled_from(("search", "free")), TITLES)),
        lambda gait, text: gait.look(head_mode(text)),
    ),
    "lift": (st.tuples(NUMBERS), GaitController.lift),
    "kick": (
        st.tuples(PAIRS, QUATERNIONS, FRAMES), lambda gait, *pose: gait.kick(kick_goal(*pose)),
    ),
    "motors": (st.tuples(st.booleans()), GaitController.note_motors),
    "publishers": (
        st.tuples(*[st.integers(0, 3)] * 3),
        lambda gait, *counts: gait.note_publishers(PublisherCounts(*counts)),
    ),
    "parameters": (st.tuples(PARAMETERS), GaitController.change_parameters),
}  # fmt: skip
"""Arguments of a request to the gait, and what it does."""
OTHERS = {
    "service": st.sampled_from(("stand", "relax", "get_up")),
    "restart": st.none(),
    "clock": st.integers(-(10**9), 10**10),
}
"""What else happens once: a service is called, the gait restarts, the clock is set [ns]."""


def _lists(elements: st.SearchStrategy[Any], longest: int) -> st.SearchStrategy[list[Any]]:
    """Lists of all lengths alike; those of Hypothesis are mostly short."""
    return st.integers(0, longest).flatmap(
        lambda size: st.lists(elements, min_size=size, max_size=size)
    )


_KINDS = {**{kind: arguments for kind, (arguments, _) in REQUESTS.items()}, **OTHERS}
EXAMPLES = st.fixed_dictionaries({
    "seed": st.integers(0, 2**32),
    "coasts": st.booleans(),
    "bad": _lists(st.one_of([
        st.tuples(st.just(topic), st.fixed_dictionaries({}, optional=fields))
        for topic, fields in FIELDS.items()
    ]), 12),
    "requests": _lists(st.tuples(st.floats(0.0, 1.0), st.one_of([
        st.tuples(st.just(kind), content) for kind, content in _KINDS.items()
    ])), 30),
})  # fmt: skip
"""Arguments of `run`."""

# -- the gait and its robot ------------------------------------------------------------------------


Bad = Sequence[tuple[str, dict[str, Any]]]
Requests = Sequence[tuple[float, tuple[str, Any]]]


def run(
    ticks: int, seed: int = 0, coasts: bool = False, bad: Bad = (), requests: Requests = ()
) -> tuple[int, int]:
    """Run a stretch of ticks; the numbers of joint commands and of refusals.

    Args:
        ticks: Its length.
        seed: Of the valid messages, of losses, and of which invalid message comes when.
        coasts: The gait may walk on without sensors.
        bad: Topics, and the fields of a valid message that are replaced, each of them many times.
        requests: Share of the stretch at which each happens, and the request.

    Raises:
        AssertionError: Something happened that must not.
    """
    rig = Rig(seed, coasts, bad)
    due = sorted((round(share * (ticks - 1)), place) for place, (share, _) in enumerate(requests))
    before = time.thread_time()
    for tick in range(ticks):
        while due and due[0][0] == tick:
            rig.request(*requests[due.pop(0)[1]][1])
        rig.tick()
        if tick % 50 == 49:  # reading the time is slow
            before, last = time.thread_time(), before
            if before - last > HANG:
                raise AssertionError("hang")
    return rig.answers, rig.refused + sum(rig.controller.reporter.rejected.values())


class Rig:
    """A gait, a robot that follows its targets exactly, and senders of all kinds of messages."""

    def __init__(self, seed: int = 0, coasts: bool = False, bad: Bad = ()) -> None:
        self._random = random.Random(seed)
        self._noise = np.random.default_rng(seed)
        self._coasts = coasts
        self._bad: dict[str, list[dict[str, Any]]] = {topic: [] for topic in FIELDS}
        for topic, fields in bad:
            self._bad[topic].append(fields)
        self._pose = ROBOT.stand_pose.tolist()
        self._stamp = 1_000_000_000
        self._ticks = 0
        self._command_input = CommandInput(ROBOT)
        self.answers = self.refused = 0
        self._start()

    def _start(self) -> None:
        self.controller = GaitController(
            ROBOT, GaitParameters(), ControllerSettings(), lambda: 0.01 * self._ticks
        )
        self._check = CommandCheck(ROBOT)

    def tick(self) -> None:
        """The messages and timers of one control period."""
        self._ticks += 1
        self._stamp += PERIOD
        messages = list(self._messages())
        if self._random.random() < 0.05:
            self._random.shuffle(messages)
        for topic, message in messages:
            if (bad := self._one_of("wrench" if "wrench" in topic else topic)) is not None:
                self.send(topic, _changed(message, bad))
            if self._random.random() > 0.1:
                self.send(topic, message)
        if self._coasts and self._random.random() < 0.2:
            self._checked("overdue", self.controller.overdue)
        if self._ticks % 25 == 0:
            self._look_at(self.controller.watch())
        if self._ticks % 100 == 0:
            self.controller.reports()
        self._robot_side()

    def send(self, topic: str, message: Input) -> None:
        """Send one message; raises AssertionError for an exception in the gait."""
        controller = self.controller
        self._checked(f"{topic}: {message}", lambda: controller.receive(topic, lambda: message))

    def request(self, kind: str, content: Any) -> None:
        """What happens once; see `REQUESTS` and `OTHERS`."""
        controller, what = self.controller, f"{kind}: {content}"
        if kind in REQUESTS:
            _, act = REQUESTS[kind]
            self._checked(what, lambda: controller.run(
                kind, lambda: _explained(lambda: act(controller, *content))
            ))  # fmt: skip
            while controller.loads_file:  # else the run would depend on the time that takes
                self._checked(what, controller.watch)
        elif kind == "service":
            accepted, _ = controller.answer(getattr(controller, content))
            self.refused += not accepted
        elif kind == "restart":
            self.refused += sum(controller.reporter.rejected.values())
            self._start()
        else:
            self._stamp = max(0, self._stamp + content)
        self._checked(what, Output)

    def _checked(self, what: str, work: Callable[[], Output]) -> None:
        self._look_at(work())
        if self.controller.reporter.unexpected:
            raise AssertionError(f"exception for {what}")
        if self.controller.reporter.crashes:
            raise AssertionError(f"{self.controller.reporter.crashes[-1]} for {what}")

    def _look_at(self, output: Output) -> None:
        for targets, status, _ in output.answers:
            self.answers += 1
            found = self._check.check(targets)
            if found is not None:
                raise AssertionError(f"command: {found}")
            self._pose = np.asarray(targets.position).tolist()
            if status is not None:
                place = status.base_footprint_in_odom
                values = (*status.com_estimated_in_q, *status.velocity, *place)
                if not all(map(math.isfinite, values)):
                    raise AssertionError(f"status: {values}")
        for _, text in output.log:
            if len(text) > 2000:
                raise AssertionError(f"log: a line of {len(text)} characters")

    def _robot_side(self) -> None:
        """A joint command and a push, as the bridge gets them."""
        usual = {"names": JOINTS, "position": self._pose, "effort": [1.0] * len(JOINTS)}
        bad = self._one_of("joint_command") or {}
        columns = [_column(bad.get(name, {}), values) for name, values in usual.items()]
        sender, now = self._random.choice(("gait", "", "other")), 0.01 * self._ticks
        bridge = self._command_input
        self._refusable(lambda: bridge.admit(sender, now))
        read = self._refusable(lambda: bridge.read(sender, now, self._stamp, *columns))
        if read is not None and read[0] is not None:
            if not np.isfinite(read[0].position).all():
                raise AssertionError("robot: targets that are not finite")
            if not 0.0 <= read[0].stiffness <= 1.0:
                raise AssertionError(f"robot: stiffness {read[0].stiffness}")
        push = {"force": (1.0, 0.0, 0.0), "torque": (0.0,) * 3, "frame": "world"}
        push |= self._one_of("push") or {}
        force = self._refusable(lambda: read_push(**push))  # type: ignore[arg-type]
        if force is not None and not np.isfinite(force).all():
            raise AssertionError(f"robot: push {force}")

    def _refusable(self, work: Callable[[], Any]) -> Any:
        """The result; None if it was refused."""
        try:
            return _explained(work)
        except NaoGaitError:
            self.refused += 1
            return None

    def _one_of(self, topic: str) -> dict[str, Any] | None:
        found = self._bad.get(topic)
        if found and self._random.random() < BAD_SHARE:
            return self._random.choice(found)
        return None

    def _messages(self) -> Iterator[tuple[str, Input]]:
        """The valid messages of a control period."""
        stamp, uniform = divmod(self._stamp, 1_000_000_000), self._random.uniform
        noise = self._noise.normal(0.0, 0.002, len(JOINTS) + 3)
        x, y, z = (25.0 * noise[:3]).tolist()
        yield "imu/data", ImuInput(*stamp, (x, y, 0.0), (y, z, 9.81 + x))
        yield "joint_states", JointInput(*stamp, JOINTS, (self._pose + noise[3:]).tolist())
        if self._random.random() < 0.1:
            linear, yaw = (uniform(-0.3, 0.4), uniform(-0.3, 0.4), 0.0), uniform(-0.3, 0.4)
            yield "cmd_vel", TwistInput(linear, (0.0, 0.0, yaw))
        if self._random.random() < 0.02:
            yield "temperature", TemperatureInput(*stamp, self._random.choice(JOINTS), 50.0)
        if self.controller.needs_loads:
            for side, frame in enumerate(ROBOT.sole_frames):
                yield f"{frame}/wrench", LoadInput(*stamp, side, uniform(0.0, 50.0))


def _explained(work: Callable[[], Any]) -> Any:
    """Do it; raises AssertionError for a refusal without field or allowed values."""
    try:
        return work()
    except NaoGaitError as error:
        if not (error.field and error.allowed):
            raise AssertionError(f"refusal without field or allowed values: {error}") from error
        raise


def _changed(message: Input, fields: dict[str, Any]) -> Input:
    changes = dict(fields)
    if "stamp" in changes:
        changes["sec"], changes["nanosec"] = changes.pop("stamp")
    for name in {"names", "position"} & changes.keys():
        changes[name] = _column(changes[name], getattr(message, name))
    return replace(message, **changes)


def _column(change: dict[int, Any] | list[Any], values: list[Any]) -> list[Any]:
    if isinstance(change, list):
        return change
    return [change.get(place, value) for place, value in enumerate(values)]
