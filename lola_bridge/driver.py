"""The process that holds LoLA's socket and answers every frame in time.

It is a process of its own, started by the node: garbage collection, discovery or a long callback of
ROS cannot delay an answer. When the node dies it makes the robot sit down and waits for another.

    LoLA -> driver -> node -> topics -> gait -> joint_command -> node -> driver -> LoLA

The answer leaves as soon as the command for this frame is there, at the latest `ANSWER_SHARE` of a
period after the frame. In lockstep it waits without end.
"""

import contextlib
import gc
import json
import os
import select
import signal
import socket
import statistics
import struct
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass

from lola_bridge.codec import (
    SENSOR_BYTES,
    LolaCommand,
    LolaSensors,
    decode_sensors,
    encode_command,
)
from lola_bridge.link import (
    COMMAND,
    END,
    SETTINGS,
    DriverStatus,
    SensorPacket,
    address,
    pack_frame,
    pack_log,
    unpack_command,
)
from lola_bridge.motor_watch import MotorLimits
from lola_bridge.safety import JointCommand, Mode, SafeCommand, Safety, SafetySettings
from robot_core.errors import NaoGaitError, one_line
from robot_core.log import Level, LogLine, Throttle

ANSWER_SHARE = 0.67
"""Share of a period for which an answer waits for the command of its frame. LoLA wants the answer
before its next frame."""
LONGEST_ALONE = 120.0
"""[s] without a node after which a driver with a limp robot ends."""
PACKET_MAX = 16384
"""[bytes] of a packet of the node."""
RETRY = 0.5
"""[s] between two attempts to connect."""
RESTART_SILENCE = 0.6
"""[s] of frames that the node does not get after the robot was stopped or lost: more than 0.5 s
without sensors is a new start for the gait, which then begins with a stand."""
RESEND = 0.25
"""[s] after which lockstep gives an unanswered frame to the node again."""
CLOCK_SLACK = 100_000_000
"""[ns] by which the stamps, which count frames, may be behind the clock."""
FRAME_GAP = 0.15
"""[s] between two frames from which on the robot was without answers for so long that LoLA has
taken its stiffness off: its joints may be anywhere."""
FAULTS_MAX = 100
"""Unexpected errors without an answer to the robot in between, after which the driver gives up."""
_SECOND = 1_000_000_000
_COLORS = {
    Mode.LIMP: (0.0, 0.0, 1.0), Mode.HOLDING: (1.0, 1.0, 0.0),
    Mode.STARTING: (1.0, 1.0, 0.0), Mode.ACTIVE: (0.0, 1.0, 0.0),
    Mode.SITTING: (1.0, 0.0, 0.0), Mode.RESTING: (1.0, 0.0, 0.0), Mode.RELAXING: (1.0, 0.0, 0.0),
}  # fmt: skip
"""Chest light in each mode."""


@dataclass(frozen=True)
class DriverSettings:
    """What the node gives the driver.

    Attributes:
        socket: Path of LoLA's socket.
        lockstep: Wait for each command without end; stamps count frames from 0.
        safety: See `SafetySettings`.
    """

    socket: str
    lockstep: bool
    safety: SafetySettings

    def to_json(self) -> str:
        """As text."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> "DriverSettings":
        """From the text of `to_json`.

        Raises:
            NaoGaitError: It is not of this version.
        """
        try:
            values = json.loads(text)
            motors = MotorLimits(**values["safety"].pop("motors"))
            safety = SafetySettings(**values.pop("safety"), motors=motors)
            return cls(safety=safety, **values)
        except (ValueError, TypeError, KeyError, AttributeError) as error:
            raise NaoGaitError("driver settings", text[:40], f"JSON ({error})") from error


class AnswerTimes:
    """How long the answers took, and which were late."""

    def __init__(self, period: float) -> None:
        self._period = period
        self._times: list[float] = []
        self._until = 0.0
        self.late = 0
        self.median = self.worst = 0.0

    def add(self, taken: float, now: float) -> None:
        """An answer `taken` [s] after its frame, at `now` [s]."""
        self._times.append(taken)
        self.late += taken > self._period
        if now >= self._until:
            self._until = now + 1.0
            self.median, self.worst = statistics.median(self._times), max(self._times)
            self._times.clear()


class Driver:
    """One robot's connection and its safety.

    Args:
        settings: Until a node sends its own.
        listener: Where nodes connect; one at a time.
        clock: Monotonic time [s].
        wall: Time of the stamps [ns].

    Attributes:
        done: There is nothing left to do.
    """

    def __init__(
        self,
        settings: DriverSettings,
        listener: socket.socket,
        clock: Callable[[], float] = time.monotonic,
        wall: Callable[[], int] = time.time_ns,
    ) -> None:
        self._settings, self._clock = settings, clock
        self._listener = listener
        self._link: socket.socket | None = None
        self._alone_since = clock()
        self._ending = False
        self._lola: socket.socket | None = None
        self._buffer = bytearray()
        self._safety = Safety(settings.safety)
        self._period = round(settings.safety.period * _SECOND)
        self._longest_age = round(settings.safety.silence_time * _SECOND)
        self._times = AnswerTimes(settings.safety.period)
        self._throttle = Throttle()
        self._began = wall() - round(clock() * _SECOND)
        self._stamp = self._valid_from = 0 if settings.lockstep else wall()
        self._heard = False
        self._frames = self._silent = 0
        self._pending: LolaSensors | None = None
        self._waits = self._catches_up = False
        self._packet = b""
        self._command: JointCommand | None = None
        self._command_stamp = 0
        self._deadline = self._resend_at = self._arrived = self._retry_at = 0.0
        self._was_refused = self._waiting_logged = False
        self._faults = 0
        self.done = False

    @property
    def mode(self) -> Mode:
        """What it does with the robot."""
        return self._safety.mode

    # -- loop --------------------------------------------------------------------------------------

    def run(self) -> None:
        """Serve until the node has gone and the robot rests."""
        while not self.done:
            self.serve()
        self.close()

    def close(self) -> None:
        """Leave the robot and the node."""
        for each in (self._lola, self._link):
            if each is not None:
                each.close()

    def serve(self) -> None:
        """Wait for what happens next and deal with it.

        What goes wrong in a cycle must not end it, because the robot falls without answers.
        """
        try:
            self._serve()
        except Exception as error:
            self._faults += 1
            if self._faults > FAULTS_MAX:
                raise
            self._drop_cycle(error)

    def _serve(self) -> None:
        if self._lola is None:
            self._connect()
        sockets = [each for each in (self._listener, self._link, self._lola) if each is not None]
        readable, _, _ = select.select(sockets, [], [], self._patience())
        if self._link in readable:
            self._read_link()
        if self._listener in readable:  # after a node that has just ended
            self._accept()
        if self._lola in readable:
            self._read_lola()
        if self._waits:
            now = self._clock()
            ready = self._command is not None and self._command_stamp == self._stamp
            if ready or now >= self._deadline:
                self._answer()
            elif self._settings.lockstep and now >= self._resend_at:
                self._resend_at = now + RESEND
                self._send(self._packet)
        limp = self._lola is None or self.mode is Mode.LIMP
        alone = self._link is None and self._clock() - self._alone_since > LONGEST_ALONE
        self.done = limp and (self._ending or alone)

    def _drop_cycle(self, error: Exception) -> None:
        """Go on with the next frame; this one is not answered."""
        self._pending, self._command, self._waits = None, None, False
        self._warn("fault", f"driver: {one_line(error)}; frame not answered", Level.ERROR)

    def _patience(self) -> float:
        """[s] until something is due."""
        now = self._clock()
        if self._waits:
            due = self._resend_at if self._settings.lockstep else self._deadline
            return max(0.0, min(due, self._deadline) - now)
        return max(0.0, self._retry_at - now) if self._lola is None else RETRY

    # -- the robot ---------------------------------------------------------------------------------

    def _connect(self) -> None:
        now = self._clock()
        if now < self._retry_at:
            return
        self._retry_at = now + RETRY
        lola = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            lola.connect(self._settings.socket)
        except OSError as error:
            lola.close()
            if not self._waiting_logged:
                self._waiting_logged = True
                reason = error.strerror or str(error)
                text = f"socket {self._settings.socket}: {reason}; trying again each {RETRY:g} s"
                self._log(LogLine(Level.WARN, text))
            return
        self._lola, self._waiting_logged, self._heard = lola, False, False
        self._buffer.clear()
        self._safety.restart()
        self._pause()
        self._log(LogLine(Level.OK, f"connected to {self._settings.socket}"))

    def _disconnect(self, reason: str) -> None:
        if self._lola is not None:
            self._lola.close()
        self._lola, self._pending, self._waits = None, None, False
        self._retry_at = self._clock() + RETRY
        self._log(LogLine(Level.ERROR, f"socket {self._settings.socket}: {reason}"))

    def _read_lola(self) -> None:
        assert self._lola is not None
        try:
            data = self._lola.recv(64 * SENSOR_BYTES)
        except OSError as error:
            return self._disconnect(error.strerror or str(error))
        if not data:
            rest = len(self._buffer)
            half = f" in the middle of a frame ({rest} of {SENSOR_BYTES} bytes)" if rest else ""
            return self._disconnect(f"closed by the robot{half}")
        self._buffer += data
        while len(self._buffer) >= SENSOR_BYTES and self._lola is not None:
            if self._waits:
                self._answer()  # the next frame is already here
            frame = bytes(self._buffer[:SENSOR_BYTES])
            del self._buffer[:SENSOR_BYTES]
            self._take(frame)

    def _take(self, frame: bytes) -> None:
        """Begin the cycle of a frame."""
        before, self._arrived = self._arrived, self._clock()
        gap = self._arrived - before
        if self._heard and gap > FRAME_GAP and not self._settings.lockstep:
            text = f"no frame for {gap:.2f} s: the robot was without answers"
            self._warn("gap", text, Level.ERROR)
            self._safety.restart()
            self._pause()
            self._catches_up = True
        self._heard = True
        self._frames += 1
        self._stamp += self._period
        self._follow_clock()
        self._catches_up = self._catches_up and len(self._buffer) >= SENSOR_BYTES
        if self._catches_up:
            return self._send_command(self._safety.unseen())
        try:
            self._pending = decode_sensors(frame)
        except NaoGaitError as error:
            self._pending = None
            self._warn("frame", f"{error}; frame ignored")
        self._waits = True
        heard = False
        if self._pending is not None and self._silent <= 0:
            self._packet = pack_frame(SensorPacket(self._stamp, self._status(), frame))
            heard = self._send(self._packet)
        self._silent -= 1
        wait = ANSWER_SHARE * self._settings.safety.period
        if not heard:
            wait = 0.0
        elif self._settings.lockstep:
            wait = float("inf")
        self._deadline, self._resend_at = self._arrived + wait, self._arrived + RESEND

    def _follow_clock(self) -> None:
        """Keep the stamps, which count frames, near the clock; they never run backwards.

        The clock is the monotonic one since the connection, so that setting the time changes none.
        """
        # Frames of a burst, after this process was held up, are older than the clock says now.
        if self._settings.lockstep or len(self._buffer) >= SENSOR_BYTES:
            return
        ahead = self._stamp - self._began - round(self._clock() * _SECOND)
        if ahead < -CLOCK_SLACK:
            self._stamp, self._valid_from = self._stamp - ahead, self._valid_from - ahead
        elif ahead > self._period:  # a burst that came in two parts
            self._stamp -= self._period // 2

    def _answer(self) -> None:
        """End the cycle: send what the safety decides."""
        safety = self._safety
        before = safety.mode
        command = safety.step(self._pending, self._command)
        refused = safety.refusal is not None
        stopped = safety.mode is not before and before in (Mode.STARTING, Mode.ACTIVE)
        if (stopped and safety.mode is not Mode.ACTIVE) or (self._was_refused and not refused):
            self._pause()
        self._was_refused = refused
        self._waits, self._command = False, None
        for line in safety.take_log():
            self._log(line)
        self._send_command(command)
        self._faults = 0
        now = self._clock()
        self._times.add(now - self._arrived, now)

    def _send_command(self, command: SafeCommand) -> None:
        if self._lola is None:
            return
        chest = _COLORS[command.mode]
        message = encode_command(LolaCommand(command.position, command.stiffness, chest))
        try:
            self._lola.sendall(message)
        except OSError as error:
            self._disconnect(error.strerror or str(error))

    def _pause(self) -> None:
        """Let the gait start again: no frames for a while, and none of its old commands."""
        self._silent = round(RESTART_SILENCE / self._settings.safety.period)
        self._valid_from = self._stamp + self._silent * self._period
        self._deadline = 0.0  # a frame whose command no longer counts is not waited for

    # -- the node ----------------------------------------------------------------------------------

    def _accept(self) -> None:
        link, _ = self._listener.accept()
        credentials = link.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, 12)
        if self._link is not None or struct.unpack("iII", credentials)[1] != os.getuid():
            reason = "this robot has a lola_bridge already, or is another user's"
            with contextlib.suppress(OSError):
                link.send(pack_log(LogLine(Level.ERROR, reason)))
            link.close()
            return
        link.setblocking(False)
        self._link, self._ending = link, False
        self._waiting_logged = False  # the new node has to hear it

    def _read_link(self) -> None:
        while self._link is not None:
            try:
                packet = self._link.recv(PACKET_MAX)
            except BlockingIOError:
                return
            except OSError:
                packet = b""
            kind = packet[:1]
            if kind == COMMAND:
                self._take_command(packet)
            elif kind == SETTINGS:
                self._take_settings(packet[1:])
            else:
                self._lose_link(ends=kind == END)

    def _lose_link(self, ends: bool) -> None:
        if self._link is not None:
            self._link.close()
        self._link, self._alone_since, self._deadline = None, self._clock(), 0.0
        self._ending = ends
        if ends:
            self._safety.release()

    def _take_settings(self, packet: bytes) -> None:
        """Take the settings of a new node; one of another version is turned away."""
        try:
            settings = DriverSettings.from_json(packet.decode(errors="replace"))
        except NaoGaitError as error:
            self._log(LogLine(Level.ERROR, f"{error}; another version of lola_bridge?"))
            self._lose_link(ends=False)
        else:
            self._configure(settings)

    def _configure(self, settings: DriverSettings) -> None:
        """Take the settings of a new node; its gait starts again."""
        self._settings = settings
        self._safety.configure(settings.safety)
        self._period = round(settings.safety.period * _SECOND)
        self._longest_age = round(settings.safety.silence_time * _SECOND)
        self._times = AnswerTimes(settings.safety.period)
        self._pause()

    def _take_command(self, packet: bytes) -> None:
        try:
            stamp, command = unpack_command(packet)
        except NaoGaitError as error:
            self._warn("command", str(error))
            return
        if stamp > self._stamp:
            allowed = f"that of a frame, at most {self._stamp * 1e-9:.3f} s"
            late = NaoGaitError("joint_command header.stamp", f"{stamp * 1e-9:.3f} s", allowed)
            self._warn("stamp", str(late))
        elif stamp > max(self._valid_from, self._stamp - self._longest_age):
            self._command, self._command_stamp = command, stamp

    def _send(self, packet: bytes) -> bool:
        """Give a packet to the node; whether it could take it."""
        if self._link is None:
            return False
        try:
            self._link.send(packet)
        except OSError:  # its buffer is full, or it has just ended
            return False
        return True

    def _status(self) -> DriverStatus:
        times, safety = self._times, self._safety
        return DriverStatus(
            safety.mode, self._frames, safety.repeated, times.late, times.median, times.worst
        )

    def _log(self, line: LogLine) -> None:
        self._send(pack_log(line))

    def _warn(self, key: str, text: str, level: Level = Level.WARN) -> None:
        held_back = self._throttle.allow(key, self._clock())
        if held_back is not None:
            more = f" ({held_back} more like it)" if held_back else ""
            self._log(LogLine(level, text + more))


def main() -> None:
    """Run with the settings as JSON in the only argument; ends at once if there is a driver."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)  # it ends when its node ends and the robot rests
    with contextlib.suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(20))  # where it is permitted
    settings = DriverSettings.from_json(sys.argv[1])
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as listener:
        try:
            listener.bind(address(settings.socket))
        except OSError:
            return
        listener.listen(1)
        driver = Driver(settings, listener)
        gc.collect()
        gc.freeze()
        gc.disable()  # a collection takes milliseconds, and nothing here makes cycles
        try:
            driver.run()
        except Exception as error:
            sys.exit(f"lola_bridge driver: ends after {one_line(error)}")


if __name__ == "__main__":
    main()
