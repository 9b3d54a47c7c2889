"""Who else publishes on the topics of a gait, and what is to be said about it."""

from dataclasses import dataclass

from nao_lipm_gait.ros.health import Level
from nao_lipm_gait.ros.remarks import COMMANDS, SENSORS, WALK, Remarks


@dataclass(frozen=True, slots=True)
class Others:
    """Publishers on the topics of this gait, as discovery sees them; this gait counts too."""

    cmd_vel: int = 1
    joint_states: int = 1
    joint_command: int = 1

    def report(self, remarks: Remarks) -> None:
        """Say what is more than one."""
        if self.joint_states > 1:
            remarks.tell(
                SENSORS, Level.ERROR, "robots",
                f"{self.joint_states} publishers on joint_states; allowed: one robot; does "
                "another run share this ROS_DOMAIN_ID?",
            )  # fmt: skip
        if self.joint_command > 1:
            remarks.tell(
                WALK, Level.ERROR, "gaits",
                f"{self.joint_command} publishers on joint_command; allowed: one gait; the "
                "simulated robot obeys the one that it obeyed before",
            )  # fmt: skip
        if self.cmd_vel > 1:
            remarks.tell(
                COMMANDS, Level.WARN, "drivers",
                f"{self.cmd_vel} publishers on cmd_vel; the newest command counts",
            )  # fmt: skip
