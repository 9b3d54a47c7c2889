"""The server's messages as typed values in SI units, and the players' actions as messages.

The server also tells each player the true pose of its torso (`pos`, `quat`). `percepts` leaves it
out, so that it cannot reach a player; `torso_truth` reads it for a judge.
"""

import base64
import binascii
import math
from collections.abc import Mapping
from typing import NamedTuple

from rcss_bridge.sexpr import Expression, named, parse, write
from robot_core.errors import NaoGaitError
from robot_core.types import Point3, Pose2

LENGTH_BYTES = 4
"""Size of the length before each message, big-endian."""
MESSAGE_MAX = 1 << 20
"""[bytes] of the longest message that is taken; the server's have some thousand."""
SPEECH_MAX = 10
"""[bytes] of the longest team message that others hear."""


class Polar(NamedTuple):
    """A place in the frame of the head's camera: x ahead, y left, z up.

    Attributes:
        distance: [m]
        azimuth: [rad], counter-clockwise.
        elevation: [rad], upwards.
    """

    distance: float
    azimuth: float
    elevation: float


class SeenPlayer(NamedTuple):
    """Another player, or the player's own limbs.

    Attributes:
        team: Name of its team.
        number: Its number.
        parts: Where its parts are seen: `head`, `lfoot`, `rfoot`.
    """

    team: str
    number: int
    parts: dict[str, Polar]


class Sight(NamedTuple):
    """What the server says the camera sees; exact, and nothing is missed.

    Attributes:
        marks: Landmarks by the server's names.
        ball: The ball, if it is in the field of view.
        players: Players of both teams.
    """

    marks: dict[str, Polar]
    ball: Polar | None
    players: tuple[SeenPlayer, ...]


class Speech(NamedTuple):
    """A message that was heard.

    Attributes:
        azimuth: [rad] of its speaker.
        data: At most `SPEECH_MAX` bytes.
    """

    azimuth: float
    data: bytes


class Game(NamedTuple):
    """The state of the game.

    Attributes:
        time: Play time [s].
        mode: The server's name of the play mode.
        left: Name of the team that defends the goal at negative x; empty if there is none yet.
        right: The same for positive x.
        score: Goals of the left and the right team.
    """

    time: float
    mode: str
    left: str
    right: str
    score: tuple[int, int]


class Percepts(NamedTuple):
    """What a player perceives in a cycle.

    Attributes:
        time: Of the simulation [s]; it does not begin at 0.
        game: The state of the game.
        joints: Angle [rad] by the name of the server's sensor, without `q_`: `llj1`.
        angular_velocity: [rad/s] of the torso in the torso's frame.
        linear_acceleration: Specific force [m/s^2] in the torso's frame, +9.81 upwards at rest.
        sight: What is seen; None in a cycle without vision, which is every second one.
        heard: Messages of others.
    """

    time: float
    game: Game
    joints: dict[str, float]
    angular_velocity: Point3
    linear_acceleration: Point3
    sight: Sight | None
    heard: tuple[Speech, ...]


# -- percepts --------------------------------------------------------------------------------------


def percepts(message: bytes) -> Percepts:
    """The percepts of a message of the server, without ground truth.

    Raises:
        NaoGaitError: The message cannot be read, lacks a sensor, or has a number that is not
            finite.
    """
    try:
        return _percepts(parse(message))
    except (ValueError, IndexError, KeyError, TypeError, AttributeError, OverflowError) as error:
        text = f"{len(message)} bytes that begin with {message[:24]!r}"
        raise NaoGaitError("percepts", text, f"those of rcsssmj ({_reason(error)})") from error


def _percepts(top: Expression) -> Percepts:
    _, (_, now) = _one(top, "time")
    joints = {}
    for _, name, angle, *_ in named(top, "HJ"):
        joints[_name(name[1])] = math.radians(_number(angle[1]))
    rates = _vector(_one(_one(top, "GYR"), "rt"))
    x, y, z = (math.radians(each) for each in rates)
    sights = [_sight(each) for each in named(top, "See")]
    heard = tuple(
        Speech(math.radians(_number(azimuth)), base64.b64decode(text, validate=True))
        for each in named(top, "MIC")
        for azimuth, text in each[2:]
    )
    return Percepts(
        _number(now),
        _game(_one(top, "GS")),
        joints,
        (x, y, z),
        _vector(_one(_one(top, "ACC"), "a")),
        sights[-1] if sights else None,
        heard,
    )


def torso_truth(message: bytes) -> tuple[Point3, tuple[float, float, float, float]]:
    """The true place [m] and orientation w, x, y, z of the torso: for a judge, never for a player.

    Raises:
        NaoGaitError: The message does not have them.
    """
    try:
        top = parse(message)
        place = _vector(_one(_one(top, "pos"), "p"))
        w, x, y, z = map(_number, _one(_one(top, "quat"), "q")[1:])
    except (ValueError, IndexError, TypeError) as error:
        text = f"{len(message)} bytes that begin with {message[:24]!r}"
        raise NaoGaitError("truth", text, f"pos and quat ({_reason(error)})") from error
    return place, (w, x, y, z)


def _game(expression: Expression) -> Game:
    values = {each[0]: each[1] for each in expression[1:]}
    return Game(
        _number(values["t"]),
        _text(values["pm"]),
        _text(values.get("tl", "")),
        _text(values.get("tr", "")),
        (int(values["sl"]), int(values["sr"])),
    )


def _sight(expression: Expression) -> Sight:
    marks: dict[str, Polar] = {}
    players = []
    for each in expression[1:]:
        if each[0] == "P":
            _, (_, team), (_, number), *parts = each
            places = {_text(name): _polar(pol) for name, pol in parts}
            players.append(SeenPlayer(_text(team), int(number), places))
        else:
            marks[_text(each[0])] = _polar(each[1])
    ball = marks.pop("B", None)
    return Sight(marks, ball, tuple(players))


def _polar(expression: Expression) -> Polar:
    _, distance, azimuth, elevation = expression
    a, e = math.radians(_number(azimuth)), math.radians(_number(elevation))
    return Polar(_number(distance), a, e)


def _vector(expression: Expression) -> Point3:
    _, x, y, z = expression
    return _number(x), _number(y), _number(z)


def _one(expression: Expression, name: str) -> Expression:
    for each in named(expression, name):
        return each
    raise ValueError(f"no {name}")


def _name(sensor: str) -> str:
    return _text(sensor).removeprefix("q_")


def _text(atom: str) -> str:
    if not isinstance(atom, str):
        raise ValueError("a list in place of an atom")
    return atom


def _number(atom: str) -> float:
    value = float(_text(atom))
    if not math.isfinite(value):
        raise ValueError(f"{atom} in place of a number")
    return value


def _reason(error: Exception) -> str:
    if isinstance(error, binascii.Error):
        return "a message that is not base64"
    return str(error).splitlines()[0][:60] if str(error) else type(error).__name__


# -- actions ---------------------------------------------------------------------------------------


class Motor(NamedTuple):
    """What a motor is to do; its torque is kp (position - q) + kd (velocity - dq) + torque.

    Attributes:
        position: [rad]
        velocity: [rad/s]
        kp: [N m/rad]
        kd: [N m s/rad]
        torque: Feed-forward [N m].
    """

    position: float
    velocity: float
    kp: float
    kd: float
    torque: float


def init(robot: str, team: str, number: int) -> bytes:
    """The first message of a player."""
    return write([["init", robot, team, number]])


def actions(
    motors: Mapping[str, Motor], beam: Pose2 | None = None, speech: bytes | None = None
) -> bytes:
    """What a player does in a cycle.

    Args:
        motors: By the names of the server's effectors: `lle1`.
        beam: x, y [m], yaw [rad] in the own half, where the robot is dropped; the server takes it
            before a kick-off only. x points to the opponents' goal.
        speech: At most `SPEECH_MAX` bytes to all players near it.

    Raises:
        NaoGaitError: A number is not finite, or the speech is too long.
    """
    parts = []
    for name, motor in motors.items():
        if not all(map(math.isfinite, motor)):
            raise NaoGaitError(name, tuple(motor), "finite numbers")
        q, dq, kp, kd, tau = motor
        parts.append(
            f"({name} {math.degrees(q):.4f} {math.degrees(dq):.4f} {kp:.3f} {kd:.3f} {tau:.4f})"
        )
    if beam is not None:
        x, y, yaw = beam
        if not all(map(math.isfinite, beam)):
            raise NaoGaitError("beam", beam, "finite numbers")
        parts.append(f"(beam {x:.3f} {y:.3f} {math.degrees(yaw):.2f})")
    if speech is not None:
        if not 0 < len(speech) <= SPEECH_MAX:
            raise NaoGaitError("speech", f"{len(speech)} bytes", f"1 to {SPEECH_MAX} bytes")
        parts.append(f"(SPK say 100 {base64.b64encode(speech).decode()})")
    return ("".join(parts) + "(syn)").encode()


# -- frames on the connection ----------------------------------------------------------------------


def framed(message: bytes) -> bytes:
    """A message with its length before it."""
    return len(message).to_bytes(LENGTH_BYTES, "big") + message


class Unframer:
    """Takes the bytes of a connection and gives the messages in them."""

    def __init__(self) -> None:
        self._buffer = bytearray()

    def add(self, data: bytes) -> None:
        """Take bytes."""
        self._buffer += data

    def next(self) -> bytes | None:
        """The next complete message; None if it has not arrived.

        Raises:
            NaoGaitError: It is longer than `MESSAGE_MAX`: this is no server.
        """
        if len(self._buffer) < LENGTH_BYTES:
            return None
        length = int.from_bytes(self._buffer[:LENGTH_BYTES], "big")
        if length > MESSAGE_MAX:
            raise NaoGaitError("message", f"{length} bytes", f"at most {MESSAGE_MAX} bytes")
        end = LENGTH_BYTES + length
        if len(self._buffer) < end:
            return None
        message = bytes(self._buffer[LENGTH_BYTES:end])
        del self._buffer[:end]
        return message
