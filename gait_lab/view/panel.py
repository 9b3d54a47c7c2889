"""Sliders for cmd_vel, a push button, and what the gait is doing, beside the scene."""

import math
from typing import Any

from gait_lab.view.link import Heard
from nao_lipm_gait.types import VelocityCommand

PUSH_DURATION = 0.1
"""[s] for which the simulated robot is pushed."""


class Panel:
    """The controls. Callbacks come on threads of their own and only leave a note."""

    def __init__(self, server: Any) -> None:
        gui = server.gui
        self._words = gui.add_markdown("waiting for the robot")
        with gui.add_folder("Drive"):
            self.x = gui.add_slider("forward [cm/s]", min=-35.0, max=35.0, step=1.0,
                                    initial_value=0.0)  # fmt: skip
            self.y = gui.add_slider("left [cm/s]", min=-12.0, max=12.0, step=1.0,
                                    initial_value=0.0)  # fmt: skip
            self.yaw = gui.add_slider("turn [°/s]", min=-60.0, max=60.0, step=1.0,
                                      initial_value=0.0)  # fmt: skip
            self.stop = gui.add_button("stop", color="red")
        with gui.add_folder("Push"):
            self.impulse = gui.add_slider("impulse [N s]", min=0.25, max=4.0, step=0.25,
                                          initial_value=1.0)  # fmt: skip
            self.direction = gui.add_dropdown(
                "towards", ("left", "right", "front", "back"), initial_value="left"
            )
            self.push = gui.add_button("push")
        self.follow = gui.add_checkbox("camera follows", initial_value=True)
        self.through = gui.add_checkbox("see through the robot", initial_value=False,
                                        hint="to the CoM and the pendulum")  # fmt: skip
        self._pushes: list[tuple[float, float]] = []
        self.stop.on_click(lambda _: self.stand_still())
        self.push.on_click(lambda _: self._note_push())

    @property
    def command(self) -> VelocityCommand:
        """What the sliders ask for."""
        return VelocityCommand(
            0.01 * self.x.value, 0.01 * self.y.value, math.radians(self.yaw.value)
        )

    def stand_still(self) -> None:
        for slider in (self.x, self.y, self.yaw):
            slider.value = 0.0

    def _note_push(self) -> None:
        angle = {"front": 0.0, "left": 0.5, "back": 1.0, "right": -0.5}[self.direction.value]
        self._pushes.append((self.impulse.value / PUSH_DURATION, angle * math.pi))

    def take_push(self, heading: float) -> tuple[float, float] | None:
        """Force [N] in the world of a push that was clicked, once; None if there is none."""
        if not self._pushes:
            return None
        force, angle = self._pushes.pop(0)
        return force * math.cos(heading + angle), force * math.sin(heading + angle)

    def tell(self, heard: Heard, rate: float) -> None:
        """Show what the gait is doing; `rate` [Hz] of the joint states."""
        x, y, yaw = heard.speed
        content = (
            f"**{heard.support or 'no gait yet'}**  \n"
            f"{_whole(100 * x)} cm/s forward, {_whole(100 * y)} cm/s left, "
            f"{_whole(math.degrees(yaw))}°/s  \n"
            f"sensors at {rate:.0f} Hz, t = {max(0, heard.stamp) * 1e-9:.1f} s"
        )
        if content != self._words.content:
            self._words.content = content


def _whole(value: float) -> int:
    """Rounded, without a minus before 0."""
    return int(round(value))
