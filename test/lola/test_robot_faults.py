"""Faults of a robot behind LoLA while it walks: what notices them, what it then does, how it ends.

Each is tried on an obedient robot, frame by frame, and on the simulated robot of `lola_server`. Run
as a program, this file prints the trials as a table. That no command is beyond a limit of
angle, speed or stiffness is checked in every cycle (`Chain.check`).
"""

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from lola_bridge import driver
from lola_bridge.codec import JOINTS, TOUCH, LolaCommand, LolaSensors
from lola_bridge.link import END, SETTINGS, pack_command
from lola_bridge.safety import REST, Mode
from lola_chain import PERIOD, Chain, Fault, Node, chain
from lola_frames import CONFIG, MAP
from robot_core.types import GaitState

WALKED = 1.9
"""[s] after which the robot walks and the fault begins."""
DRIVEN = [joint for joint, each in zip(JOINTS, MAP.driven, strict=True) if each]


class Hooks(Fault):
    """A fault of a few functions in place of the methods of `Fault`."""

    def __init__(self, **hooks: Callable) -> None:
        for name, hook in hooks.items():
            assert hasattr(self, name)
            setattr(self, name, hook)


@dataclass(frozen=True)
class Row:
    """A fault and what is right.

    Attributes:
        name: What is wrong.
        make: Makes the fault; it may keep a state.
        notice: Begin of the line of the log that names it; empty = nothing is said.
        within: [s] from the begin of the fault to that line, or to the end state without one.
        action: What the robot then does.
        end: How it ends, see `end_of`.
        last: [s] for which the fault is watched.
        held: How a robot ends that cannot fall; empty = the same.
        robots: On which it is tried.
    """

    name: str
    make: Callable[[], Fault]
    notice: str
    within: float
    action: str
    end: str
    last: float = 1.6
    held: str = ""
    robots: tuple[str, ...] = ("frames", "server")


# -- makers of faults ------------------------------------------------------------------------------


def at(field: str, place: int | str, value: float, until: float = math.inf) -> Callable[[], Fault]:
    """A number of the frame is another one."""
    names: tuple[str, ...] = TOUCH if field == "touch" else JOINTS
    index = names.index(place) if isinstance(place, str) else place

    def frame(found: LolaSensors, time: float) -> LolaSensors:
        values = list(getattr(found, field))
        if time < until:
            values[index] = type(values[index])(value) if math.isfinite(value) else value
        return found._replace(**{field: values})

    return lambda: Hooks(frame=frame)


def moved(joint: str, by: float) -> Callable[[], Fault]:
    """A joint is turned away from its command within 0.2 s."""
    index = JOINTS.index(joint)

    def frame(found: LolaSensors, time: float) -> LolaSensors:
        position = list(found.position)
        position[index] += by * min(1.0, time / 0.2)
        return found._replace(position=position)

    return lambda: Hooks(frame=frame)


def stuck(*fields: str, place: str = "") -> Callable[[], Fault]:
    """Fields, or one joint of them, keep their first value."""

    def make() -> Fault:
        first: dict[str, list[float]] = {}

        def frame(found: LolaSensors, _time: float) -> LolaSensors:
            for field in fields:
                kept = first.setdefault(field, list(getattr(found, field)))
                values = list(getattr(found, field))
                places = [JOINTS.index(place)] if place else range(len(values))
                for index in places:
                    values[index] = kept[index]
                found = found._replace(**{field: values})
            return found

        return Hooks(frame=frame)

    return make


def whole(change: Callable[[LolaSensors, float], LolaSensors]) -> Callable[[], Fault]:
    """A frame is changed."""
    return lambda: Hooks(frame=change)


def pressed(*buttons: str, times: Callable[[float], bool]) -> Callable[[], Fault]:
    """Buttons are down at some times [s]."""

    def frame(found: LolaSensors, time: float) -> LolaSensors:
        down = times(time)
        touch = [float(down and name in buttons) for name in TOUCH]
        return found._replace(touch=touch)

    return lambda: Hooks(frame=frame)


HEAD = ("head_front", "head_middle", "head_rear")


def data(change: Callable[[bytes, float], bytes | None]) -> Callable[[], Fault]:
    """The bytes of a frame are changed."""
    return lambda: Hooks(data=change)


def shifted() -> Fault:
    """A hundred bytes of a frame are missing: every later frame begins at the wrong place."""
    return Hooks(data=lambda frame, time: frame[100:] if time < PERIOD / 2 else frame)


def command(
    change: Callable[[int, list[float], list[float], float], bytes | None],
) -> Callable[[], Fault]:
    """The node's packets are changed."""
    return lambda: Hooks(command=change)


def commanded(place: str, value: Callable[[float], float]) -> Callable[[], Fault]:
    """A joint is commanded to another angle [rad] at a time [s]."""

    def change(stamp: int, position: list[float], stiffness: list[float], time: float) -> bytes:
        position[JOINTS.index(place)] = value(time)
        return pack_command(stamp, position, stiffness)

    return lambda: Hooks(command=change)


def once(act: Callable[[Chain], None]) -> Callable[[], Fault]:
    """Something happens at the begin."""

    def make() -> Fault:
        done: list[bool] = []

        def run(chain: Chain, _time: float) -> None:
            if not done:
                done.append(True)
                act(chain)

        return Hooks(act=run)

    return make


def held_up(seconds: float) -> Callable[[], Fault]:
    """The machine does not run the driver for a while; the frames wait for it."""
    return once(lambda chain: setattr(chain, "hangs_until", chain.now + seconds))


def frozen(seconds: float) -> Callable[[], Fault]:
    """Neither frames nor answers pass for a while; then they are those of now."""
    return once(lambda chain: setattr(chain, "frozen_until", chain.now + seconds))


def killed_node(chain: Chain) -> None:
    """`kill -9` of the node; its gait is not answered either."""
    assert chain.node is not None
    chain.node.close()
    chain.node = None


def lost_cable(chain: Chain) -> None:
    """Nobody commands a velocity any more."""
    assert chain.node is not None
    chain.node.driven = False


def next_node(chain: Chain) -> None:
    """`kill -9` of the node, and a new one."""
    killed_node(chain)
    chain.attach()


def second_node(chain: Chain) -> None:
    """Another program wants the robot."""
    other = Node(chain.settings, lambda: chain.now)
    chain.others.append(other)


def stranger(chain: Chain) -> None:
    """The node is another version's."""
    killed_node(chain)
    other = Node(chain.settings, lambda: chain.now)
    other.send(SETTINGS + b"{}")
    chain.others.append(other)


def ended_node(chain: Chain) -> None:
    """Ctrl-C."""
    assert chain.node is not None
    chain.node.send(END)
    chain.node.close()
    chain.node = None


def broken_cycle(_: Chain) -> None:
    """An error that nobody has thought of, once."""
    pack = driver.pack_frame

    def fails(*_: object) -> bytes:
        driver.pack_frame = pack
        raise ZeroDivisionError

    driver.pack_frame = fails


def killed_driver(chain: Chain) -> None:
    """`kill -9` of the driver, or the computer stops."""
    chain.driver_is_killed = True


def closed(seconds: float) -> Callable[[], Fault]:
    """LoLA ends and listens again after a while."""

    def make() -> Fault:
        def act(chain: Chain, time: float) -> None:
            if chain.listens == (time < seconds):
                chain.close_lola() if time < seconds else chain.listen()

        return Hooks(act=act)

    return make


def falls(found: LolaSensors, time: float) -> LolaSensors:
    """It tilts to the left within 0.4 s, and lies."""
    roll = -min(1.5, time / 0.4 * 1.5)
    force = (0.0, -9.81 * math.sin(roll), -9.81 * math.cos(roll))
    rate = -1.5 / 0.4 if time < 0.4 else 0.0
    return found._replace(
        angles=(roll, 0.0), accelerometer=force, gyroscope=(rate, 0.0, 0.0), fsr=[0.0] * 8
    )


NAN = math.nan
SITS, LIMP, WALKS, STANDS = "sits", "limp", "walks", "stands"
NOTHING = "none"
LOLA = "LoLA takes its stiffness off, it falls"
FALLS = "falls, goes limp"
DOWN, OFF, ON, HOLD = "sits down", "goes limp", "walks on", "stops and stands"


def alone(joint: str) -> tuple[str, str]:
    """Action and end of a joint that is given up alone."""
    return f"`{joint}` goes limp", f"{WALKS}, `{joint}` limp"


KNEE, ANKLE, HIP = "LKneePitch", "RAnklePitch", "RHipRoll"
ELBOW, SHOULDER, NECK = "LElbowRoll", "RShoulderPitch", "HeadPitch"
CYCLE, SILENCE, TIME = 0.013, 0.16, 1.2
"""[s] One frame; silence_time and what it takes to say so; motor_time."""

ROWS = (
    # motors
    Row("leg motor at 85 deg C", at("temperature", KNEE, 85.0), f"{KNEE} at 85", CYCLE, DOWN,
        SITS),
    Row("leg motor with `Status` 2", at("status", HIP, 2), f"{HIP} at", CYCLE, DOWN, SITS),
    Row("leg motor with `Status` 3", at("status", ANKLE, 3), f"{ANKLE} at", CYCLE, DOWN, SITS),
    Row("arm motor at 115 deg C", at("temperature", ELBOW, 115.0), f"{ELBOW} at 115", CYCLE,
        *alone(ELBOW)),
    Row("head motor at 110 deg C", at("temperature", NECK, 110.0), f"{NECK} at 110", CYCLE,
        *alone(NECK)),
    Row("arm motor with `Status` 3", at("status", SHOULDER, 3), f"{SHOULDER} at", CYCLE,
        *alone(SHOULDER)),
    Row("no temperature of a leg motor", at("temperature", KNEE, NAN), "", 0.0, ON, WALKS),
    Row("leg motor draws 6 A", at("current", KNEE, 6.0), f"{KNEE} draws", 0.45, OFF, LIMP, 2.0),
    Row("arm motor draws 6 A", at("current", SHOULDER, 6.0), f"{SHOULDER} draws", 0.45,
        *alone(SHOULDER)),
    Row("6 A for 0.1 s", at("current", KNEE, 6.0, until=0.1), "", 0.0, ON, WALKS),
    Row("no current of a hand", at("current", "RHand", NAN), "", 0.0, ON, WALKS),
    Row("knee 1.4 rad from its command", moved(KNEE, 1.4), f"{KNEE} is", TIME, OFF, LIMP, last=2.0),
    Row("elbow 0.6 rad from its command", moved(ELBOW, -0.6), f"{ELBOW} is", TIME, *alone(ELBOW)),
    Row("encoder of a knee sticks", stuck("position", place=KNEE), f"{KNEE} shows", 2.0, OFF,
        LIMP, last=3.0, robots=("frames",)),
    # battery, body
    Row("battery at 3 %", at("battery", 0, 0.03), "battery at 3 %", CYCLE, DOWN, SITS),
    Row("battery's status -32552", at("battery", 1, -32552.0), "", 0.0, ON, WALKS),
    Row("no charge of the battery", at("battery", 0, NAN), "LoLA Battery", CYCLE, DOWN, SITS),
    Row("another body version", whole(lambda found, _: found._replace(
        robot_config=CONFIG._replace(body_version="5.0.0"))), "body version", CYCLE, DOWN, SITS),
    # buttons
    Row("chest button touched for 12 ms", pressed("chest", times=lambda t: t < CYCLE),
        "stopped by a button", CYCLE, DOWN, SITS),
    Row("chest button bounces for 0.5 s", pressed("chest", times=lambda t: t < 0.5
        and t % 0.096 < 0.024), "stopped by a button", CYCLE, DOWN, SITS),
    Row("chest button stays down", pressed("chest", times=lambda t: True), "stopped by a button",
        CYCLE, DOWN, SITS),
    Row("three head buttons", pressed(*HEAD, times=lambda t: t < 0.2), "head buttons: limp", CYCLE,
        OFF, LIMP),
    Row("one head button", pressed(HEAD[0], times=lambda t: True), "", 0.0, ON, WALKS),
    Row("a button is no number", at("touch", "chest", NAN), "LoLA Touch", CYCLE, DOWN, SITS),
    # sensors
    Row("no angle of a knee in one frame", at("position", KNEE, NAN, until=CYCLE),
        "LoLA Position", CYCLE, ON, WALKS),
    Row("no angle of a knee", at("position", KNEE, NAN), "LoLA Position", CYCLE, DOWN, SITS),
    Row("no angle of a hand", at("position", "LHand", NAN), "", 0.0, ON, WALKS),
    Row("no angular rate", at("gyroscope", 0, NAN), "LoLA Gyroscope", CYCLE, DOWN, SITS),
    Row("gyro and accelerometer freeze", stuck("gyroscope", "accelerometer"), "imu/data", 0.15,
        HOLD, STANDS, 3.0),
    Row("force sensors without numbers", at("fsr", 0, NAN), "", 0.0, ON, WALKS),
    Row("sonar without numbers", at("sonar", 0, NAN), "", 0.0, ON, WALKS),
    Row("the robot falls", whole(falls), "fallen", 0.3, OFF, LIMP),
    Row("the robot is lifted", whole(lambda found, _: found._replace(fsr=[0.0] * 8)), "lifted", 0.4,
        HOLD, "lifted"),
    # frames
    Row("one frame of other bytes", data(lambda f, t: b"\xc1" * 896 if t < CYCLE else f),
        "LoLA message", CYCLE, ON, WALKS),
    Row("only other bytes", data(lambda f, _: b"\xc1" * 896), "LoLA message", CYCLE, DOWN, SITS),
    Row("100 bytes are lost, all later frames are cut wrongly", shifted, "LoLA message", 2 * CYCLE,
        DOWN, SITS),
    Row("no frames for 0.05 s", frozen(0.05), "", 0.0, ON, WALKS),
    Row("no frames for 2 s", frozen(2.0), "no frame for 2", 2.1, LOLA, LIMP, 6.0, WALKS),
    Row("LoLA ends, and is back after 1 s", closed(1.0), "socket", CYCLE, LOLA, LIMP, 5.0,
        WALKS),
    Row("the driver is held up for 0.07 s", held_up(0.07), "", 0.0, ON, WALKS),
    Row("the driver is held up for 0.5 s", held_up(0.5), "no frame for 0.5", 0.6,
        LOLA, LIMP, 4.0, WALKS),
    Row("the clock is set by 50 s", once(lambda chain: setattr(chain, "wall_ahead", 50.0)), "", 0.0,
        ON, WALKS),
    # commands and processes
    Row("the cable with `cmd_vel` is lost", once(lost_cable), "no cmd_vel", 0.55, HOLD, STANDS,
        3.0),
    Row("the gait is silent", command(lambda *_: None), "no joint_command", SILENCE, DOWN, SITS),
    Row("the gait is silent for 0.1 s", command(lambda s, p, k, t: None if t < 0.1
        else pack_command(s, p, k)), "", 0.0, ON, WALKS),
    Row("a command is no number", commanded(NECK, lambda _: NAN), "command", CYCLE, DOWN, SITS),
    Row("a command of half a packet", command(lambda s, p, k, _: pack_command(s, p, k)[:99]),
        "command: got '99 bytes'", CYCLE, DOWN, SITS),
    Row("head commanded to 5 rad", commanded(NECK, lambda _: 5.0), "", 0.0,
        "stops at its limit", WALKS),
    Row("arm commanded to and fro each frame", commanded(
        SHOULDER, lambda t: 2.0 * (-1) ** round(t / PERIOD)), "", 0.0,
        "moves as fast as it may", WALKS),
    Row("stiffness 7", command(lambda s, p, k, _: pack_command(s, p, [7.0 * v for v in k])), "",
        0.0, "stiffness 1", WALKS),
    Row("answers to old frames", command(lambda s, p, k, _: pack_command(s - 700_000_000, p, k)),
        "no joint_command", SILENCE, DOWN, SITS),
    Row("answers to frames of the future", command(
        lambda s, p, k, _: pack_command(s + 10**9, p, k)), "joint_command header.stamp", CYCLE,
        DOWN, SITS),
    Row("the node is killed", once(killed_node), "", SILENCE, DOWN, SITS),
    Row("the node is killed and started again", once(next_node), "", SILENCE,
        "sits down, stands up", WALKS, last=3.0),
    Row("the node ends (Ctrl-C)", once(ended_node), "", CYCLE, "sits down, goes limp", LIMP),
    Row("a second node", once(second_node), "", 0.0, "is turned away", WALKS),
    Row("a node of another version", once(stranger), "", SILENCE, DOWN, SITS),
    Row("an unexpected error in a cycle", once(broken_cycle), "driver: ZeroDivisionError", CYCLE,
        ON, WALKS),
    Row("the driver is killed", once(killed_driver), "", SILENCE, LOLA, LIMP),
    Row("a hot knee, no usable frame and a silent gait", lambda: Hooks(
        data=lambda f, _: b"\x00" * 896, command=lambda *_: None), "LoLA message", CYCLE, DOWN,
        SITS),
    Row("a motor of a knee has no torque", once(lambda chain: chain.body.weaken(KNEE)),
        "fallen", 0.5, FALLS, LIMP, robots=("server",)),
    Row("a push of 15 N s", once(lambda chain: chain.body.push(150.0)), "fallen", 0.5, FALLS, LIMP,
        robots=("server",)),
)


# -- trials ----------------------------------------------------------------------------------------


def end_of(chain: Chain) -> str:
    """How the robot ends."""
    stiff = chain.body.stiffness
    if max(stiff) == 0.0:
        return LIMP
    if chain.driver.mode is Mode.RESTING and max(stiff) <= REST and not chain.body.lies:
        return SITS
    if chain.driver.mode is not Mode.ACTIVE or chain.node is None or chain.body.lies:
        return f"{chain.driver.mode}, lies: {chain.body.lies}"
    soft = [joint for joint in DRIVEN if stiff[JOINTS.index(joint)] == 0.0]
    state = {GaitState.WALK: WALKS, GaitState.STAND: STANDS}.get(
        chain.gait_state, str(chain.gait_state)
    )
    return ", ".join([state, *(f"`{joint}` limp" for joint in soft)])


def tried(row: Row, kind: str, folder: Path) -> None:
    """Walk, inject the fault, and compare what happens with the row."""
    with chain(folder, kind) as made:
        made.attach()
        made.run(WALKED)
        assert end_of(made) == WALKS, made.log
        made.fault, made.begin = row.make(), made.now
        seen = len(made.log)
        noticed = math.inf
        for _ in range(round(row.last / PERIOD)):
            made.cycle()
            said = any(text.startswith(row.notice) for _, text in made.log[seen:])
            changed = made.driver.mode is not Mode.ACTIVE or max(made.body.stiffness) == 0.0
            if said if row.notice else changed:
                noticed = min(noticed, made.now - made.begin)
        log = [text for _, text in made.log[seen:]]
        assert end_of(made) == ((row.held or row.end) if kind == "frames" else row.end), log
        assert noticed <= row.within if row.within else noticed == math.inf, (noticed, log)


def table() -> str:
    """All trials; faults that are noticed and end alike share a row."""
    same: dict[tuple[str, str, str], list[str]] = {}
    for row in ROWS:
        within = f"{row.within:g} s"
        if row.within <= 2 * CYCLE:
            within = ("-", "1 frame", "2 frames")[round(row.within / CYCLE)]
        end = f"{row.end}; held upright: {row.held}" if row.held else row.end
        same.setdefault((within, row.action, end), []).append(row.name)
    lines = ["| faults | noticed within | the robot | end |", "|---|---|---|---|"]
    lines += [f"| {'; '.join(names)} | {' | '.join(row)} |" for row, names in same.items()]
    return "\n".join(lines) + "\n"


def rows_for(robot: str) -> list[Row]:
    """The faults that are tried on a robot."""
    return [row for row in ROWS if robot in row.robots]


FIRST = {(row.action, row.end, row.held): row for row in reversed(rows_for("server"))}
"""What the simulated robot does and how it ends, each once; the others run with the slow tests."""


@pytest.mark.parametrize("row", rows_for("frames"), ids=lambda row: row.name)
def test_a_fault_of_an_obedient_robot_ends_as_the_table_says(row: Row, tmp_path: Path) -> None:
    tried(row, "frames", tmp_path)


@pytest.mark.parametrize(
    "row",
    [
        pytest.param(row, marks=() if row in FIRST.values() else pytest.mark.slow, id=row.name)
        for row in rows_for("server")
    ],
)
def test_a_fault_of_the_simulated_robot_ends_as_the_table_says(
    row: Row, tmp_path: Path, mujoco_only: None
) -> None:
    tried(row, "server", tmp_path)


def test_a_command_beyond_a_limit_would_be_found(tmp_path: Path) -> None:
    """The check of every cycle can fail."""
    with chain(tmp_path, "frames") as made:
        for position, stiffness in ((9.0, 1.0), (0.0, 1.5)):
            command = LolaCommand([position] * len(JOINTS), [stiffness] * len(JOINTS))
            with pytest.raises(AssertionError):
                made.check(command)


if __name__ == "__main__":
    sys.stdout.write(table())
