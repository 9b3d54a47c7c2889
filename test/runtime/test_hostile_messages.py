"""Messages that anyone on the network may send: refused in one short line, without a late tick.

A tick is late if its thread computes for too long; what other threads do, and how busy the machine
is, does not count.
"""

import gc
import math
import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from test_controller import NAMES, ROBOT, Robot

from nao_lipm_gait.runtime.inputs import (
    ImuInput,
    Input,
    JointInput,
    LoadInput,
    TemperatureInput,
    TwistInput,
    head_angles,
    head_mode,
    head_point,
    kick_goal,
)
from robot_core.types import GaitState

LONGEST = 3000
"""[characters] of a line of the log, or of a motion's result."""
LATE = 0.02
"""[s] of processor time of the control thread for one message."""
LONG = "\x1b[2J\n" * 2_000_000
MANY = [f"joint{n}" for n in range(200_000)]
Act = Callable[[Robot], None]
UNIT = (0.0, 0.0, 0.0, 1.0)


def received(topic: str, make: Callable[[Robot], Input]) -> Act:
    def act(robot: Robot) -> None:
        robot.take(robot.controller.receive(topic, lambda: make(robot)))

    return act


def looked(topic: str, make: Callable[[], object]) -> Act:
    def act(robot: Robot) -> None:
        controller = robot.controller
        robot.take(controller.run(topic, lambda: controller.look(make())))  # type: ignore[arg-type]

    return act


def messages(folder: Path) -> Iterator[tuple[str, Act]]:
    def at(robot: Robot) -> tuple[int, int]:
        return divmod(robot.stamp + 10_000_000, 1_000_000_000)

    for name, value in (("nan", math.nan), ("inf", math.inf), ("1e308", 1e308)):
        far = (value, 0.0, 0.0)
        yield f"cmd_vel {name}", received("cmd_vel", lambda _, v=far: TwistInput(v, v))
        yield f"imu {name}", received("imu/data", lambda r, v=far: ImuInput(*at(r), v, v))
        yield f"joints {name}", received(
            "joint_states", lambda r, v=value: JointInput(*at(r), NAMES, [v] * len(NAMES))
        )
        yield f"load {name}", received("l_sole/wrench", lambda r, v=value: LoadInput(*at(r), 0, v))
        yield f"look {name}", looked("~/look_at", lambda v=far: head_point("x", v, "odom", ROBOT))
        yield f"lift {name}", lambda r, v=value: r.take(
            r.controller.run("~/lift", lambda: r.controller.lift(v))
        )
        yield f"kick {name}", lambda r, v=value: r.take(r.controller.run(
            "~/kick", lambda: r.controller.kick(kick_goal((v, v), UNIT, "base_footprint"))
        ))  # fmt: skip
    for count, names in (("many", MANY), ("long", [LONG] * 2), ("same", NAMES[:1] * 200_000)):
        zeros = [0.0] * len(names)
        yield f"joints {count}", received(
            "joint_states", lambda r, n=names, z=zeros: JointInput(*at(r), n, z)
        )
        yield f"head {count}", looked("~/head", lambda n=names, z=zeros: head_angles(n, z, ROBOT))
    yield "positions", received("joint_states", lambda r: JointInput(*at(r), NAMES, [0.0] * 10**6))
    yield "joint stamp", received(
        "joint_states", lambda r: JointInput(-1, 2**32 - 1, NAMES, r.pose)
    )
    yield "heat", received("temperature", lambda r: TemperatureInput(*at(r), LONG, 300.0))
    yield "mode", looked("~/head_mode", lambda: head_mode(LONG))
    yield "frame", looked("~/look_at", lambda: head_point("x", (0.0, 0.0, 0.0), LONG, ROBOT))
    yield "kick frame", lambda r: r.take(
        r.controller.run("~/kick", lambda: r.controller.kick(kick_goal((0, 0), UNIT, LONG)))
    )
    pipe, bomb = folder / "pipe.yaml", folder / "bomb.yaml"
    os.mkfifo(pipe)
    rows = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    rows += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]" for n in range(1, 9)]
    bomb.write_text("\n".join(rows))
    files = (pipe, bomb, folder, "/dev/zero", "/proc/self/mem", "/dev/stdin", folder / "no.yaml")
    names = (LONG, "\0", "", "../" * 10_000 + "x.yaml", "~nobody/x.yaml", *map(str, files))
    for name in names:
        yield f"motion {name[:20]!r}", lambda r, n=name: r.request(n)


@pytest.fixture
def no_garbage() -> Iterator[None]:
    """No collection within a message; the node collects after its answers."""
    gc.disable()
    yield
    gc.enable()


def test_no_message_makes_a_tick_late_or_ends_in_more_than_a_line(
    tmp_path: Path, no_garbage: None
) -> None:
    robot = Robot()
    robot.tick(60)
    robot.request("unknown")  # reads the shipped motions, as the node does before it starts
    wrong = []
    for name, act in messages(tmp_path):
        robot.log.clear()
        robot.results.clear()
        answers = len(robot.sent)
        began = time.thread_time()
        act(robot)
        spent = time.thread_time() - began
        if spent > LATE:
            wrong.append(f"{name}: {1e3 * spent:.0f} ms")
        robot.tick(3)
        while robot.controller.loads_file:
            robot.tick()
        if len(robot.sent) < answers + 3 or robot.controller.state is not GaitState.STAND:
            wrong.append(f"{name}: {robot.controller.state}")
        reports = [report.message for report in robot.reports().values()]
        for line in (*robot.log, *robot.results, *reports):
            if len(line) > LONGEST or not line.isprintable():
                wrong.append(f"{name}: {line[:80]!r}")
    assert not wrong
