"""Requested motions: how they reach the gait, and what is reported about them."""

from pathlib import Path

from nao_lipm_gait.gait import Gait
from nao_lipm_gait.motion.scheduler import GET_UP
from nao_lipm_gait.runtime.diagnostics import WALK, Diagnostics
from nao_lipm_gait.runtime.motion_requests import MotionRequests
from robot_core.errors import NaoGaitError
from robot_core.log import Level
from robot_core.motion.motion_file import load_motions
from robot_core.types import GaitStatus

SIT_DOWN = "sit"
"""Motion that saves hot legs."""


class MotionCommands:
    """Passes requests to the gait and follows the last one to its end.

    Args:
        gait: The gait.
        diagnostics: Takes the lines for the log.
    """

    def __init__(self, gait: Gait, diagnostics: Diagnostics) -> None:
        self._gait = gait
        self._diagnostics = diagnostics
        self._requests = MotionRequests()
        self._results: list[str] = []

    def request(self, name: str) -> None:
        """Run a motion as soon as it can begin.

        Args:
            name: Name of the motion, or the path of its YAML file.

        Raises:
            NaoGaitError: For a motion that is unknown or cannot begin here.
        """
        try:
            if name.endswith(".yaml"):
                motion = load_motions(Path(name), self._gait.robot)[0]
                self._gait.request_motion(motion)
                name = motion.name
            else:
                self._gait.request_motion(name)
        except NaoGaitError as error:
            self._results.append(self._requests.refuse(name, str(error)))
            raise
        self._accepted(name)

    def get_up(self) -> None:
        """Get up from the floor.

        Raises:
            NaoGaitError: If the robot does not lie.
        """
        self._gait.request_motion(GET_UP)
        self._accepted(GET_UP)

    def sit_down(self, reason: str) -> None:
        """Stop and sit down; a robot that has no such motion stays as it is."""
        try:
            self.request(SIT_DOWN)
        except NaoGaitError as error:
            text = f"{reason}, but the robot cannot sit down: {error}"
        else:
            text = f"{reason}: sitting down; ~/stand stands up again"
        self._diagnostics.event(WALK, Level.ERROR, "hot legs", text)

    def follow(self, status: GaitStatus) -> None:
        """Follow the last request through a tick of the gait."""
        gait = self._gait
        self._report(
            self._requests.update(
                status.state, status.motion, gait.motion_waits, gait.motion_ended
            )
        )

    def take_results(self) -> tuple[str, ...]:
        """What became of motions since the last call, as `name: outcome`."""
        results = tuple(self._results)
        self._results.clear()
        return results

    def _accepted(self, name: str) -> None:
        self._report(self._requests.request(name))

    def _report(self, result: str | None) -> None:
        if result is None:
            return
        self._results.append(result)
        level = Level.OK if result.endswith(": done") else Level.WARN
        self._diagnostics.log(level, f"motion {result}")
