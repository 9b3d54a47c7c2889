"""Team messages within the server's 10 bytes: 80 bits, in metres of the server's field."""

import math
import zlib
from collections.abc import Iterator, Mapping

from nao_soccer.game_state import Role
from nao_soccer.team.message import BallMessage, TeamMessage
from rcss_bridge.codec import SPEECH_MAX
from robot_core.errors import NaoGaitError

_FAR_X, _FAR_Y = 57.0, 40.0
"""[m] Largest coordinates that can be told: a little beyond the largest field."""
_BITS = {
    "tag": 9, "player": 4, "x": 11, "y": 10, "yaw": 6, "valid": 1, "fallen": 1, "role": 2,
    "seconds": 7, "seen": 1, "ball_x": 11, "ball_y": 10, "age": 4, "deviation": 3,
}  # fmt: skip
_YAWS = 1 << _BITS["yaw"]
_ETA_STEP, _AGE_STEP, _DEVIATION_STEP = 0.5, 0.25, 0.25
"""[s], [s], [m] of one count."""
_ROLES = tuple(Role)


def pack(message: TeamMessage, team: str, size: float) -> bytes:
    """The bytes to say; lengths of the message are those of the server over `size`."""
    ball = message.ball
    x, y, yaw = message.pose
    values = {
        "tag": _tag(team),
        "player": min(message.player, _last("player")),
        "x": _counts(size * x, _FAR_X, "x"),
        "y": _counts(size * y, _FAR_Y, "y"),
        "yaw": round(math.remainder(yaw, math.tau) / math.tau * _YAWS) % _YAWS,
        "valid": message.valid,
        "fallen": message.fallen,
        "role": _ROLES.index(message.role),
        "seconds": min(round(message.seconds_to_ball / _ETA_STEP), _last("seconds")),
        "seen": ball is not None,
        "ball_x": 0 if ball is None else _counts(size * ball.position[0], _FAR_X, "ball_x"),
        "ball_y": 0 if ball is None else _counts(size * ball.position[1], _FAR_Y, "ball_y"),
        "age": 0 if ball is None else min(round(ball.age / _AGE_STEP), _last("age")),
        "deviation": 0
        if ball is None
        else min(round(size * ball.deviation / _DEVIATION_STEP), _last("deviation")),
    }
    whole = 0
    for name, bits in _BITS.items():
        whole = whole << bits | int(values[name])
    return whole.to_bytes(SPEECH_MAX, "big")


def unpack(data: bytes, team: str, size: float) -> TeamMessage:
    """The message that was heard; its `team`, `count` and `time` are 0.

    Raises:
        NaoGaitError: It is not of this team.
    """
    if len(data) != SPEECH_MAX:
        raise NaoGaitError("speech", f"{len(data)} bytes", f"{SPEECH_MAX} bytes")
    of = dict(_values(int.from_bytes(data, "big")))
    if of["tag"] != _tag(team) or of["role"] >= len(_ROLES) or not of["player"]:
        raise NaoGaitError("speech", data.hex(), f"a message of {team}")
    ball = None
    if of["seen"]:
        place = _metres(of, "ball_x", _FAR_X) / size, _metres(of, "ball_y", _FAR_Y) / size
        deviation = _DEVIATION_STEP * of["deviation"] / size
        ball = BallMessage(place, (0.0, 0.0), deviation, _AGE_STEP * of["age"])
    return TeamMessage(
        team=0,
        player=of["player"],
        count=0,
        time=0,
        pose=(
            _metres(of, "x", _FAR_X) / size,
            _metres(of, "y", _FAR_Y) / size,
            math.remainder(of["yaw"] * math.tau / _YAWS, math.tau),
        ),
        valid=bool(of["valid"]),
        fallen=bool(of["fallen"]),
        penalized=False,
        role=_ROLES[of["role"]],
        seconds_to_ball=_ETA_STEP * of["seconds"],
        ball=ball,
    )


def _tag(team: str) -> int:
    """Tells the own team's messages from others."""
    return zlib.crc32(team.encode()) % (1 << _BITS["tag"])


def _values(whole: int) -> Iterator[tuple[str, int]]:
    for name, bits in reversed(_BITS.items()):
        yield name, whole & (1 << bits) - 1
        whole >>= bits


def _last(name: str) -> int:
    """The largest count that the bits of a value hold."""
    return (1 << _BITS[name]) - 1


def _counts(metres: float, far: float, name: str) -> int:
    return round((min(max(metres, -far), far) / far + 1.0) / 2.0 * _last(name))


def _metres(of: Mapping[str, int], name: str, far: float) -> float:
    return (2.0 * of[name] / _last(name) - 1.0) * far
