"""Team messages: what a player tells its team mates, in at most 128 bytes.

A message has a magic, the version, who speaks, a count, the time of the sender, pose, what
it knows of the ball, its role, its estimated time to the ball, and the robots that it sees.
Positions are in the frame of the field of the own team, in mm. All numbers are little-endian.
"""

import math
import struct
from dataclasses import dataclass

from nao_soccer.game_state import Role
from nao_soccer.world.state import TeamRobot
from robot_core.errors import NaoGaitError
from robot_core.types import Point2, Pose2

SIZE_MAX = 128
"""[bytes] Largest team message that the Standard Platform League allows."""
PORT_BASE = 10000
"""UDP port of a team = this plus its number."""
ROBOTS_MAX = 8
"""Number of robots that a message tells of, at most."""
ROBOT_AGE_MAX = 2.5
"""[s] The longest time since a robot was seen that can be told; more is told as this."""
NEVER = 60.0
"""[s] The longest time that can be told; more is told as this."""

_MAGIC = b"nlgT"
_VERSION = 2
_LAYOUT = struct.Struct("<4s4BHI3hHB2h2h2H")
_ROBOT = struct.Struct("<2h2B")
SIZES = range(_LAYOUT.size, _LAYOUT.size + ROBOTS_MAX * _ROBOT.size + 1, _ROBOT.size)
"""[bytes] of a message, by the number of robots."""
_ROLES = tuple(Role)
_VALID, _FALLEN, _BALL, _PENALIZED = 1, 2, 4, 8
_FAR = 32.0
"""[m] Largest coordinate that can be told."""


@dataclass(frozen=True, slots=True)
class BallMessage:
    """The ball as the sender has seen it.

    Attributes:
        position: [m] in the field.
        velocity: [m/s] in the field.
        deviation: Standard deviation [m] of the position.
        age: [s] since it saw it.
    """

    position: Point2
    velocity: Point2
    deviation: float
    age: float


@dataclass(frozen=True, slots=True)
class TeamMessage:
    """What a player tells.

    Attributes:
        team: Number of its team.
        player: Its number.
        count: Number of the message, modulo 65536.
        time: [ms] of the sender's clock, modulo 2^32.
        pose: x, y [m], yaw [rad] in the field.
        valid: It trusts this pose.
        fallen: It lies or gets up.
        penalized: The referee makes it stand still.
        role: The role that it plays.
        seconds_to_ball: Estimated time [s] until it plays the ball; at most `NEVER`.
        ball: The ball that it has seen itself; None if it has not.
        robots: The robots that it has seen itself; the first `ROBOTS_MAX` are told.
    """

    team: int
    player: int
    count: int
    time: int
    pose: Pose2
    valid: bool
    fallen: bool
    penalized: bool
    role: Role
    seconds_to_ball: float
    ball: BallMessage | None = None
    robots: tuple[TeamRobot, ...] = ()

    def encode(self) -> bytes:
        """The bytes of the message; NaoGaitError if a value does not fit."""
        ball = self.ball or BallMessage((0.0, 0.0), (0.0, 0.0), 0.0, 0.0)
        flags = _VALID * self.valid + _FALLEN * self.fallen + _PENALIZED * self.penalized
        x, y, yaw = self.pose
        try:
            data = _LAYOUT.pack(
                _MAGIC, _VERSION, self.team, self.player,
                flags + (_BALL if self.ball is not None else 0),
                self.count % 65536, self.time % 2**32,
                _mm(x), _mm(y), round(1e4 * math.remainder(yaw, math.tau)),
                round(100.0 * min(max(self.seconds_to_ball, 0.0), NEVER)),
                _ROLES.index(self.role),
                _mm(ball.position[0]), _mm(ball.position[1]),
                _mm(ball.velocity[0]), _mm(ball.velocity[1]),
                _mm(ball.deviation), round(100.0 * min(ball.age, NEVER)),
            )  # fmt: skip
            return data + b"".join(
                _ROBOT.pack(
                    _mm(each.position[0]), _mm(each.position[1]),
                    round(100.0 * min(each.age, ROBOT_AGE_MAX)), each.mate,
                )
                for each in self.robots[:ROBOTS_MAX]
            )  # fmt: skip
        except (struct.error, ValueError, OverflowError) as error:
            raise NaoGaitError("team message", str(self), f"values that fit ({error})") from error


def decode(data: bytes) -> TeamMessage:
    """Read a team message; NaoGaitError if it is none, or a value is not allowed."""
    where = "team message"
    if len(data) not in SIZES or data[:4] != _MAGIC:
        allowed = f"{SIZES[0]} to {SIZES[-1]} bytes, {_MAGIC!r}"
        raise NaoGaitError(where, f"{len(data)} bytes, {data[:4]!r}", allowed)
    (
        _, version, team, player, flags, count, time, x, y, yaw, eta, role, bx, by, vx, vy,
        deviation, age,
    ) = _LAYOUT.unpack_from(data)  # fmt: skip
    if version != _VERSION:
        raise NaoGaitError(f"{where} version", version, str(_VERSION))
    if role >= len(_ROLES):
        raise NaoGaitError(f"{where} role", role, f"0 to {len(_ROLES) - 1}")
    if not 1 <= player <= 20:
        raise NaoGaitError(f"{where} player", player, "1 to 20")
    ball = None
    if flags & _BALL:
        ball = BallMessage(
            (bx / 1000.0, by / 1000.0), (vx / 1000.0, vy / 1000.0), deviation / 1000.0, age / 100.0
        )
    return TeamMessage(
        team, player, count, time,
        (x / 1000.0, y / 1000.0, yaw / 1e4),
        bool(flags & _VALID), bool(flags & _FALLEN), bool(flags & _PENALIZED),
        _ROLES[role], min(eta / 100.0, NEVER), ball,
        tuple(
            TeamRobot((x / 1000.0, y / 1000.0), age / 100.0, bool(mate))
            for x, y, age, mate in _ROBOT.iter_unpack(data[_LAYOUT.size :])
        ),
    )  # fmt: skip


def _mm(meters: float) -> int:
    return round(1000.0 * min(max(meters, -_FAR), _FAR))
