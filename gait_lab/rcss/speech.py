"""Team messages within the server's 10 bytes: 80 bits, in metres of the server's field."""

import math
import zlib
from collections.abc import Iterator

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
_ETA_STEP, _AGE_STEP, _DEVIATION_STEP = 0.5, 0.25, 0.25
"""[s], [s], [m] of one count."""
_ROLES = tuple(Role)


def pack(message: TeamMessage, team: str, size: float) -> bytes:
    """The bytes to say; lengths of the message are those of the server over `size`."""
    ball = message.ball
    x, y, yaw = message.pose
    values = {
        "tag": _tag(team),
        "player": min(message.player, 15),
        "x": _counts(size * x, _FAR_X, 11),
        "y": _counts(size * y, _FAR_Y, 10),
        "yaw": round(math.remainder(yaw, math.tau) / math.tau * 64.0) % 64,
        "valid": message.valid,
        "fallen": message.fallen,
        "role": _ROLES.index(message.role),
        "seconds": min(round(message.seconds_to_ball / _ETA_STEP), 127),
        "seen": ball is not None,
        "ball_x": 0 if ball is None else _counts(size * ball.position[0], _FAR_X, 11),
        "ball_y": 0 if ball is None else _counts(size * ball.position[1], _FAR_Y, 10),
        "age": 0 if ball is None else min(round(ball.age / _AGE_STEP), 15),
        "deviation": 0 if ball is None else min(round(size * ball.deviation / _DEVIATION_STEP), 7),
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
        place = _metres(of["ball_x"], _FAR_X, 11) / size, _metres(of["ball_y"], _FAR_Y, 10) / size
        deviation = _DEVIATION_STEP * of["deviation"] / size
        ball = BallMessage(place, (0.0, 0.0), deviation, _AGE_STEP * of["age"])
    return TeamMessage(
        team=0,
        player=of["player"],
        count=0,
        time=0,
        pose=(
            _metres(of["x"], _FAR_X, 11) / size,
            _metres(of["y"], _FAR_Y, 10) / size,
            math.remainder(of["yaw"] * math.tau / 64.0, math.tau),
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
    return zlib.crc32(team.encode()) % 512


def _values(whole: int) -> Iterator[tuple[str, int]]:
    for name, bits in reversed(_BITS.items()):
        yield name, whole & (1 << bits) - 1
        whole >>= bits


def _counts(metres: float, far: float, bits: int) -> int:
    last = (1 << bits) - 1
    return round((min(max(metres, -far), far) / far + 1.0) / 2.0 * last)


def _metres(counts: int, far: float, bits: int) -> float:
    return (2.0 * counts / ((1 << bits) - 1) - 1.0) * far
