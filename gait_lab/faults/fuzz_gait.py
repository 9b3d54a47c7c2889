"""Fuzzing of the gait, and of what the bridge reads of its commands."""

import math
import random
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
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
TRIPLES = st.tuples(NUMBERS, NUMBERS, NUMBERS)
TITLES = st.one_of(
    st.sampled_from((*JOINTS, "", "Tail", "\u0000", "%s%n", "../../etc")), st.text(max_size=20)
)
FRAMES = st.one_of(st.sampled_from(("odom", "base_footprint", "torso", "world")), TITLES)
STAMPS = st.tuples(
    st.one_of(st.sampled_from((-(2**31), -1, 0, 1, 2**31 - 1)), st.integers(-(2**31), 2**31 - 1)),
    st.one_of(st.sampled_from((0, 10**9 - 1, 10**9, 2**32 - 1)), st.integers(0, 2**32 - 1)),
)
PLACES = st.integers(0, 63)
EDITS = st.lists(
    st.one_of(
        st.tuples(st.just("value"), PLACES, NUMBERS),
        st.tuples(st.just("name"), PLACES, TITLES),
        st.tuples(st.sampled_from(("delete", "cut", "longer", "rotate")), PLACES, st.none()),
    ),
    min_size=1, max_size=4,
)  # fmt: skip
"""Changes of the names and columns of a message with joints, one after the other."""
QUATERNIONS = st.tuples(NUMBERS, NUMBERS, NUMBERS, NUMBERS)
FIELDS: dict[str, dict[str, st.SearchStrategy[Any]]] = {
    "cmd_vel": {"linear": TRIPLES, "angular": TRIPLES},
    "imu/data": {
        "stamp": STAMPS, "angular_velocity": TRIPLES, "linear_acceleration": TRIPLES,
        "orientation": QUATERNIONS, "orientation_covariance": NUMBERS,
        "angular_velocity_covariance": NUMBERS, "linear_acceleration_covariance": NUMBERS,
    },
    "joint_states": {"stamp": STAMPS, "edits": EDITS},
    "wrench": {"stamp": STAMPS, "force": NUMBERS},
    "temperature": {"stamp": STAMPS, "joint": TITLES, "degrees": NUMBERS},
    "joint_command": {"edits": EDITS},
    "push": {"force": TRIPLES, "torque": TRIPLES, "frame": FRAMES},
}  # fmt: skip
"""Fields of each topic that may be replaced in a valid message."""
REQUESTS = st.one_of(
    st.tuples(st.just("service"), st.sampled_from(("stand", "relax", "get_up"))),
    st.tuples(st.just("motion"), st.one_of(
        st.sampled_from(tuple(shipped_library(ROBOT).motions)), st.sampled_from(MOTION_FILES),
        TITLES)),
    st.tuples(st.just("head"), st.tuples(
        st.sampled_from((ROBOT.head, ("Tail", "HeadYaw"))), st.tuples(NUMBERS, NUMBERS))),
    st.tuples(st.just("look_at"), st.tuples(TRIPLES, FRAMES)),
    st.tuples(st.just("follow"), st.tuples(TRIPLES, FRAMES)),
    st.tuples(st.just("head_mode"), st.one_of(st.sampled_from(("search", "free")), TITLES)),
    st.tuples(st.just("lift"), NUMBERS),
    st.tuples(st.just("kick"), st.tuples(
        st.tuples(NUMBERS, NUMBERS), st.tuples(NUMBERS, NUMBERS, NUMBERS, NUMBERS), FRAMES)),
    st.tuples(st.just("motors"), st.booleans()),
    st.tuples(st.just("publishers"), st.tuples(*[st.integers(0, 3)] * 3)),
    # A number from 0 to 1 is a share of the range of the parameter.
    st.tuples(st.just("parameters"), st.dictionaries(
        st.sampled_from(sorted(BY_NAME)),
        st.one_of(st.floats(0.0, 1.0), st.sampled_from((math.nan, 1e9, "x", None, True))),
        min_size=1, max_size=4)),
    st.tuples(st.just("restart"), st.none()),
    st.tuples(st.just("clock"), st.integers(-(10**9), 10**10)),
)  # fmt: skip
"""Requests and changes that happen once, as (kind, content)."""


@dataclass(frozen=True, slots=True)
class Example:
    """What happens in a stretch of ticks.

    Attributes:
        seed: Of the valid messages, of losses, and of which invalid message comes when.
        bad: Topics, and the fields of a valid message that are replaced, each of them many times.
        requests: Share of the stretch at which each happens, and the request.
    """

    seed: int
    coasts: bool
    bad: list[tuple[str, dict[str, Any]]]
    requests: list[tuple[float, tuple[str, Any]]]


def _lists(elements: st.SearchStrategy[Any], longest: int) -> st.SearchStrategy[list[Any]]:
    """Lists of all lengths alike; those of Hypothesis are mostly short."""
    return st.integers(0, longest).flatmap(
        lambda size: st.lists(elements, min_size=size, max_size=size)
    )


BAD = st.one_of([
    st.tuples(st.just(topic), st.fixed_dictionaries({}, optional=fields))
    for topic, fields in FIELDS.items()
])  # fmt: skip
EXAMPLES = st.builds(
    Example, st.integers(0, 2**32), st.booleans(), _lists(BAD, 12),
    _lists(st.tuples(st.floats(0.0, 1.0), REQUESTS), 30),
)  # fmt: skip

# -- the gait and its robot ------------------------------------------------------------------------


def run(example: Example, ticks: int) -> tuple[int, int]:
    """Run an example; the numbers of joint commands and of refusals. Raises AssertionError."""
    rig = Rig(example)
    due = sorted((round(share * (ticks - 1)), place)
                 for place, (share, _) in enumerate(example.requests))  # fmt: skip
    before = time.thread_time()
    for tick in range(ticks):
        while due and due[0][0] == tick:
            rig.request(*example.requests[due.pop(0)[1]][1])
        rig.tick()
        if tick % 50 == 49:  # reading the time is slow
            before, last = time.thread_time(), before
            if before - last > HANG:
                raise AssertionError("hang")
    return rig.answers, rig.refused + sum(rig.controller.rejected.values())


class Rig:
    """A gait, a robot that follows its targets exactly, and senders of all kinds of messages."""

    def __init__(self, example: Example) -> None:
        self._random = random.Random(example.seed)
        self._noise = np.random.default_rng(example.seed)
        self._coasts = example.coasts
        self._bad: dict[str, list[dict[str, Any]]] = {topic: [] for topic in FIELDS}
        for topic, fields in example.bad:
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
        """Call a service, send a request, or change the clock, the parameters or the gait."""
        controller, what = self.controller, f"{kind}: {content}"
        looks: dict[str, Callable[[], Any]] = {
            "head": lambda: head_angles(content[0], content[1], ROBOT),
            "look_at": lambda: head_point("look_at", content[0], content[1], ROBOT),
            "follow": lambda: head_follow(content[0], content[1], ROBOT),
            "head_mode": lambda: head_mode(content),
        }
        if kind == "motion":
            act = partial(controller.request_motion, content)
            self._checked(what, lambda: controller.run("motion", act))
            while controller.loads_file:  # else the run would depend on the time that takes
                self._checked(what, controller.watch)
        elif kind == "kick":
            self._checked(
                what, lambda: controller.run(kind, lambda: controller.kick(kick_goal(*content)))
            )
        elif kind == "lift":
            self._checked(what, lambda: controller.run(kind, lambda: controller.lift(content)))
        elif kind in looks:
            self._checked(
                what, lambda: controller.run(kind, lambda: controller.look(looks[kind]()))
            )
        elif kind == "service":
            accepted, _ = controller.answer(getattr(controller, content))
            self.refused += not accepted
        elif kind == "motors":
            controller.note_motors(content)
        elif kind == "publishers":
            controller.note_publishers(PublisherCounts(*content))
        elif kind == "parameters":
            self._refusable(lambda: controller.change_parameters(_values(content)))
        elif kind == "restart":
            self.refused += sum(controller.rejected.values())
            self._start()
        else:
            self._stamp = max(0, self._stamp + content)
        self._checked(what, Output)

    def _checked(self, what: str, work: Callable[[], Output]) -> None:
        self._look_at(work())
        if self.controller.unexpected:
            raise AssertionError(f"exception for {what}")
        if self.controller.crashes:
            raise AssertionError(f"{self.controller.crashes[-1]} for {what}")

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
        names, position, effort = list(JOINTS), list(self._pose), [1.0] * len(JOINTS)
        bad = self._one_of("joint_command") or {}
        _edit(bad.get("edits", ()), names, position, effort)
        sender, now = self._random.choice(("gait", "", "other")), 0.01 * self._ticks
        bridge = self._command_input
        self._refusable(lambda: bridge.admit(sender, now))
        read = self._refusable(
            lambda: bridge.read(sender, now, self._stamp, names, position, effort)
        )
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
        """The result; None if it was refused, with field and allowed values."""
        try:
            return work()
        except NaoGaitError as error:
            if not (error.field and error.allowed):
                raise AssertionError(f"refusal without field or allowed values: {error}") from error
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


def _changed(message: Input, fields: dict[str, Any]) -> Input:
    changes = {key: value for key, value in fields.items() if key not in ("stamp", "edits")}
    if "stamp" in fields:
        changes["sec"], changes["nanosec"] = fields["stamp"]
    if isinstance(message, JointInput):
        names, position = list(message.names), list(message.position)
        _edit(fields.get("edits", ()), names, position)
        changes |= {"names": names, "position": position}
    return replace(message, **changes)


def _edit(edits: Iterable[tuple[str, int, Any]], names: list[Any], *columns: list[Any]) -> None:
    """Change names and columns in place, as `EDITS` says."""
    for kind, place, value in edits:
        column = columns[place // 32 % len(columns)]
        if kind == "longer":
            names += ["x"] * place
            for each in columns:
                each += [0.0] * place
        elif kind == "cut":
            del column[place:]
        elif kind in ("value", "name"):
            changed = column if kind == "value" else names
            if changed:
                changed[place % len(changed)] = value
        else:
            for each in (names, *columns):
                if each:
                    moved = each.pop(place % len(each))
                    each += [moved] if kind == "rotate" else []


def _values(changes: dict[str, Any]) -> dict[str, object]:
    """Values of parameters, of which numbers are given as shares of the range."""
    values: dict[str, object] = {}
    for name, value in changes.items():
        parameter = BY_NAME[name]
        if isinstance(value, float) and 0.0 <= value <= 1.0:
            if parameter.is_switch:
                value = value > 0.5
            elif parameter.choices:
                value = parameter.choices[round(value * (len(parameter.choices) - 1))]
            else:
                value = parameter.minimum + value * (parameter.maximum - parameter.minimum)
        values[name] = value
    return values
