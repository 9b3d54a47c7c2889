"""The file of a learned walk: an ONNX network, what it sees, and what its actions mean.

    target = pose + scale * action, every `period`

docs/own_robot.md has the files of two public policies.
"""

from pathlib import Path

import attrs

from robot_core import schema
from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription
from robot_core.schema import Sequence, Settings, Table, Text, number

VELOCITY = "velocity"
TERMS = (
    VELOCITY, "gyro", "gravity", "command", "phase", "joints", "joint_velocities", "action",
)  # fmt: skip


@attrs.frozen(kw_only=True)
class Observation(Settings):
    """Some of the numbers that a policy sees."""

    of: str = schema.choice(
        TERMS,
        meaning="velocity [m/s] and gyro [rad/s] of the torso in its axes; gravity: unit vector "
        "down in them; command [m/s, m/s, rad/s]; phase: cosines, then sines of the phases; joints "
        "[rad] from the pose; joint_velocities [rad/s]; action: the last one.",
    )
    scale: float = number(1.0, -1e4, 1e4)
    joints: tuple[str, ...] = schema.field(
        Sequence(Text()), (), "Of joints and joint_velocities; empty = those of the actions."
    )
    blank: tuple[str, ...] = schema.field(Sequence(Text()), (), "Joints that it sees as 0.")


@attrs.frozen(kw_only=True)
class Policy(Settings):
    """A learned walk, as its file declares it."""

    network: str = schema.field(Text(), meaning="ONNX file, beside this one.")
    period: float = number(0.02, 0.001, 0.1, "s", "Time between two actions.")
    joints: tuple[str, ...] = schema.field(
        Sequence(Text(), unique=True), (), "Joints of the actions; empty = all of the robot."
    )
    pose: dict[str, float] = schema.field(
        Table(schema.Number()), attrs.Factory(dict), "Joint angles [rad] of action 0; others: 0."
    )
    scale: float = number(1.0, 1e-6, 100.0, "rad", "Change of a joint's target per action.")
    clip: float = number(100.0, 1e-3, 1e3, "", "Largest action.")
    gains: dict[str, tuple[float, float]] = schema.field(
        Table(Sequence(schema.Number(0.0, 1e5), 2, 2)), attrs.Factory(dict),
        "Stiffness [N m/rad] and damping [N m s/rad] by a part of a joint's name; the first fits. "
        "Other joints keep those of the robot.",
    )  # fmt: skip
    frequency: float = number(0.0, 0.0, 20.0, "Hz", "Of its phases.")
    phases: tuple[float, ...] = schema.field(
        Sequence(schema.Number()), (0.0,), "Phases [rad] at the start."
    )
    rest: float = number(
        1e-5, 0.0, 1.0, "", "Norm of a command [m/s, m/s, rad/s] below which it stands."
    )
    rest_phases: tuple[float, ...] = schema.field(
        Sequence(schema.Number()), (),
        "Phases [rad] that it sees while it stands; empty: zeros in place of cosines and sines.",
    )  # fmt: skip
    command_rate: float = number(
        1e3, 0.01, 1e3, "1/s", "Largest change of the observed command per second."
    )
    observations: tuple[Observation, ...] = schema.field(Sequence(schema.Group(Observation), 1))

    @property
    def sees_velocity(self) -> bool:
        """It needs the velocity of the torso, which no robot measures."""
        return any(each.of == VELOCITY for each in self.observations)

    def gains_of(self, robot: RobotDescription) -> tuple[tuple[str, float, float], ...]:
        """Joint, stiffness, damping of each joint of the robot that has gains here."""
        found = []
        for joint in robot.joint_names:
            part = next((part for part in self.gains if part in joint), None)
            if part is not None:
                found.append((joint, *self.gains[part]))
        return tuple(found)


def load_policy(path: str | Path, robot: RobotDescription) -> tuple[Policy, Path]:
    """The policy of a file, and its network.

    Raises:
        NaoGaitError: A bad file, or joints that the robot does not have.
    """
    path = Path(path)
    where = f"policy {path}"
    policy = Policy.from_mapping(schema.read_yaml(path, "policy"), where)
    named = {
        "joints": policy.joints,
        "pose": tuple(policy.pose),
        "observations": tuple(
            name for each in policy.observations for name in (*each.joints, *each.blank)
        ),
    }
    for key, names in named.items():
        for name in names:
            if name not in robot.joint_names:
                raise NaoGaitError(f"{where}: {key}", name, robot.joint_names)
    for part in policy.gains:
        if not any(part in joint for joint in robot.joint_names):
            raise NaoGaitError(f"{where}: gains", part, f"part of a joint's name of {robot.name}")
    if policy.rest_phases and len(policy.rest_phases) != len(policy.phases):
        raise NaoGaitError(
            f"{where}: rest_phases", policy.rest_phases, f"as many as phases: {len(policy.phases)}"
        )
    return policy, path.parent / policy.network
