"""The IMU proves itself in the stand before the first walk, and in its first steps.

In the stand the accelerometer measures the vertical, which the joints over flat soles show too, and
the size of gravity. In the first steps `ImuAxes` compares accelerometer, gyro and joints.
"""

from collections import deque
from math import acos, hypot

import numpy as np

from nao_lipm_gait.runtime.imu_axes import ImuAxes
from nao_lipm_gait.whole_body.body_model import BodyModel, SolePose
from robot_core.errors import NaoGaitError
from robot_core.robot import RobotDescription
from robot_core.types import GRAVITY, LEFT, RIGHT, FloatArray, SensorFrame

FORCE_TICKS = 30
"""Ticks over which gravity is averaged."""
SETTLED_TICKS = 5
"""First ticks that are left out: a robot that is set down feels an impact."""
FORCE_RANGE = 7.0, 13.0
"""[m/s^2] Mean specific force of a robot that stands."""
DOUBTFUL_RANGE = 3.0, 30.0
"""[m/s^2] A first force outside, which may be an impact, is not used until the mean is known."""
TILT_MAX = 0.35
"""[rad] Largest angle between the vertical of the accelerometer and that over flat soles."""
LYING_TILT = 1.0
"""[rad] from there on the vertical of a robot that seems to lie."""
LYING_TICKS = 60
"""Ticks in which the loads of the soles must arrive; a robot that lies gets up later."""
INVERTED_TILT = 2.3
"""[rad] from there on the vertical points into the floor: no robot lies like that."""
SOLE_ANGLE, SOLE_STEP, SOLE_TILT = 0.15, 0.015, 0.3
"""[rad, m of a NAO, rad] Largest angle and step between the soles of a robot that stands, by its
joints, and largest angle between them and the vertical of an IMU that shows an upright torso."""
FLAT_SHARE, FLAT_REST = 0.05, 0.3
"""Share of the bend of the robot's stand below which its leg joints read nearly zero, and largest
part of what they show that is no such share: legs that are really straight show something else."""
INVERTED_SHARE = -0.3
"""Share below which the legs bend the other way."""
BEND_MIN = 0.3
"""[rad] Bend of all leg joints from which on these can be told."""
UPRIGHT_TORSO = 0.25
"""[rad] Largest angle between the torso's z axis and the vertical of the IMU for that."""
ABSURD_TICKS, ABSURD_FIRST = 15, 5
"""Ticks over which the gyro's size is judged, and must be wrong in a stand; the first of them."""
ABSURD, ABSURD_RATE = 50.0, 0.2
"""Angular acceleration [rad/s^2] by the gyro for each m/s^2 that the accelerometer changes by, and
deviation [rad/s] of the gyro, above which its unit is wrong. Right ones reach 22, in hands 36."""
FALLEN_TILT, FALLEN_TIME = 0.8, 0.08
"""[rad, s] Angle between the accelerometer's mean and both the vertical over the soles and what it
measured in the stand, from which on a robot with a wrong IMU has fallen; time constant of that
mean."""
FORCE_LEAST = 0.5
"""[m/s^2] A smaller mean force has no direction: gravity is removed."""


class SensorCheck:
    """Judges the first stand; one tick after the other.

    Args:
        robot: The robot that is measured.
        period: Control period [s].

    Attributes:
        seems_to_lie: The first frame shows a robot that lies. If its soles carry it, it does not.
        fallen: The accelerometer shows a fall, even if it is mounted otherwise.
    """

    def __init__(self, robot: RobotDescription, period: float) -> None:
        self._body = BodyModel(robot)
        corners = np.array(robot.sole_corners)
        self._corners = corners, corners * (1.0, -1.0)
        self._step = SOLE_STEP * robot.size
        self._legs = [robot.index(name) for name in robot.leg_joints]
        self._bend = robot.stand_pose[self._legs]
        self._dt, self._has_yaw_gyro = period, robot.has_yaw_gyro
        self.restart()

    def restart(self) -> None:
        """The sensors, or the robot's place, may be others from here on."""
        self._passing = self._final = ""
        self.seems_to_lie = False
        self._lying_ticks = 0
        self._up: FloatArray | None = None
        self._forces: list[FloatArray] = []
        self._stood: FloatArray | None = None
        self._gravity_is_right = False
        self._samples: deque[FloatArray] = deque(maxlen=ABSURD_TICKS)
        self._absurd = False
        self._absurd_ticks = 0
        self._axes = ImuAxes(self._body, self._dt, yaw_gyro=self._has_yaw_gyro)
        self._force: FloatArray | None = None
        self.fallen = False
        self._first = True
        self._doubtful = False

    @property
    def trouble(self) -> str:
        """Why the robot must not walk; empty while nothing is known to be wrong."""
        return self._final or self._passing

    @property
    def done(self) -> bool:
        """Nothing more is to be judged, and all was right."""
        return self._gravity_is_right and self._axes.done and not self.trouble

    def update(
        self,
        frame: SensorFrame,
        *,
        stands: bool,
        carried: bool,
        support: int = 0,
        light: bool = False,
        in_doubt: bool = False,
    ) -> SensorFrame:
        """One tick.

        Args:
            frame: As measured.
            stands: The gait stands or moves into its stand.
            carried: The soles are known to carry the robot.
            support: The leg on which it walks because it is told to, LEFT or RIGHT; else 0.
            light: The soles are known not to carry it: it lies, falls or is held.
            in_doubt: The loads of the soles do not show a robot that stands on both.

        Returns:
            The frame for the gait: without sensors that are wrong, so that it goes on standing.
        """
        if self.done:
            return frame
        force = frame.linear_acceleration
        if self._first:
            self._first = False
            self._up = self._body.vertical(frame.joint_position)
            angle = _angle(force, self._up)
            low, high = DOUBTFUL_RANGE
            self._doubtful = TILT_MAX < angle < LYING_TILT or not low < _size(force) < high
            if angle > INVERTED_TILT:
                self._passing = self._gravity_trouble(force)
            else:
                self.seems_to_lie = angle > LYING_TILT and _size(force) > FORCE_RANGE[0]
        if light and not self._final:
            self._forces.clear()
            self._samples.clear()
            self._axes.interrupt()
            self._passing = ""
            return frame
        if self.seems_to_lie and not self.trouble:
            self._lying_ticks += 1
            if not carried:
                self.seems_to_lie = self._lying_ticks < LYING_TICKS
                return frame
            self.seems_to_lie = False
            self._passing = self._gravity_trouble(force)
        self._judge_size(frame, walks=support != 0, waits=stands)
        if not stands and not self.trouble:
            self._forces.clear()
            self._judge_axes(frame, support)
            return self.at_rest(frame) if self.trouble else frame
        self._axes.interrupt()
        if self._absurd:
            return self.at_rest(frame)
        if not in_doubt or self.trouble:
            self._judge_gravity(frame)
        else:
            self._forces.clear()
        if self.trouble:
            return self.at_rest(frame)
        if self._doubtful and not self._gravity_is_right:
            # The gyro is used: it shows whether the robot falls meanwhile.
            up = self._body.vertical(frame.joint_position)
            return frame._replace(linear_acceleration=GRAVITY * up)
        return frame

    def refuse_gyro(self) -> None:
        """The gyro of a robot that walks has measured what no robot does."""
        self._final = self._final or (
            "imu/data angular_velocity: changed its unit or scale in a walk; deg/s instead of "
            "rad/s? Mend it and start the sensors again; the robot stands"
        )

    def wrong_pose(self, frame: SensorFrame) -> NaoGaitError | None:
        """Why the joints of an upright robot with both soles on the floor are wrong; None if not.

        Such a robot must not get targets: it would jump to the pose that its joints show.
        """
        share = self._share_of_stand(frame.joint_position[self._legs])
        if share is not None:
            text = (
                "the bend of a stand; sign, unit or scale of the leg joints, or do they measure "
                "nothing? Nothing is sent to the joints"
            )
            return NaoGaitError(
                "joint_states position: all leg joints", f"{share:.2g} times a stand", text
            )
        up = self._body.vertical(frame.joint_position)
        left, right = self._body.sole_in_torso(LEFT), self._body.sole_in_torso(RIGHT)
        angle = _angle(np.array(left.normal), np.array(right.normal))
        force = frame.linear_acceleration
        step = min(self._step_between(left, right, up), self._step_between(left, right, force))
        upright = _angle(force, np.array((0.0, 0.0, 1.0))) < UPRIGHT_TORSO
        tilt = _angle(force, up) if upright else 0.0
        for name, got, allowed, unit in (
            ("angle between the soles", angle, SOLE_ANGLE, "rad"),
            ("height of one sole over the other", step, self._step, "m"),
            ("tilt of both soles, while the IMU is upright", tilt, SOLE_TILT, "rad"),
        ):
            if got > allowed:
                text = (
                    f"at most {allowed:.2g} {unit} in a stand on both soles; sign, name, zero, "
                    "scale or unit of a leg joint? Nothing is sent to the joints"
                )
                return NaoGaitError(f"joint_states position: {name}", f"{got:.2g} {unit}", text)
        return None

    def _step_between(self, left: SolePose, right: SolePose, up: FloatArray) -> float:
        """Height [m] of the lowest corner of one sole over that of the other.

        A robot that was held in the middle of a step leans on an edge of the foot that it lifted:
        its soles are at one height by the IMU, not by their own normals.
        """
        heights = [
            float(np.min(sole.points(corners) @ up))
            for sole, corners in zip((left, right), self._corners, strict=True)
        ]
        return abs(heights[0] - heights[1]) / max(_size(up), 1e-6)

    def _share_of_stand(self, legs: FloatArray) -> float | None:
        """How far the leg joints (n,) [rad] bend, if nearly not or the other way; 1 in a stand."""
        bend = self._bend
        if _size(bend) < BEND_MIN:
            return None
        share = float(legs @ bend) / float(bend @ bend)
        rest = _size(legs - share * bend)
        flat = abs(share) < FLAT_SHARE and rest <= FLAT_REST * abs(share) * _size(bend)
        return share if flat or share < INVERTED_SHARE else None

    def _judge_gravity(self, frame: SensorFrame) -> None:
        if self._gravity_is_right:
            return
        self._forces.append(frame.linear_acceleration)
        if len(self._forces) < FORCE_TICKS + SETTLED_TICKS:
            return
        self._up = self._body.vertical(frame.joint_position)
        mean: FloatArray = np.mean(self._forces[SETTLED_TICKS:], axis=0)
        self._forces.clear()
        self._passing = self._gravity_trouble(mean)
        self._gravity_is_right = not self.trouble

    def _gravity_trouble(self, force: FloatArray) -> str:
        """What is wrong with the mean specific force (3,) [m/s^2]; empty if nothing is."""
        assert self._up is not None
        size, angle = _size(force), _angle(force, self._up)
        got = f"imu/data linear_acceleration: got ({', '.join(f'{v:.2f}' for v in force)}) m/s^2"
        allowed = (
            f"; allowed for a robot that stands: {FORCE_RANGE[0]:g} to {FORCE_RANGE[1]:g} m/s^2, "
            f"at most {TILT_MAX:g} rad from the vertical over its soles; "
        )
        guess = ""
        if size < FORCE_LEAST:
            guess = "is gravity removed?"
        elif 0.7 < size < 1.3:
            guess = "unit g instead of m/s^2?"
        elif not FORCE_RANGE[0] <= size <= FORCE_RANGE[1]:
            guess = "unit or scale?"
        if angle > TILT_MAX and size >= FORCE_LEAST:
            guess = f"{guess} {self._turned(force)}".strip()
        if not (guess and self.trouble):
            self._stood = force  # a robot that falls meanwhile is judged again
        return f"{got}{allowed}{guess}; the robot stands" if guess else ""

    def _turned(self, force: FloatArray) -> str:
        """A guess how the axes are turned."""
        assert self._up is not None
        up = self._up
        if _angle(-force, up) <= TILT_MAX:
            return "sign (up is positive)?"
        for first, second in ((0, 2), (1, 2), (0, 1)):
            changed = force.copy()
            changed[[first, second]] = force[[second, first]]
            for sign in (1.0, -1.0):
                if _angle(sign * changed, up) <= TILT_MAX:
                    return f"axes {'xyz'[first]} and {'xyz'[second]} exchanged or turned?"
        return "mounting of the IMU, or a robot that does not stand upright?"

    def _judge_size(self, frame: SensorFrame, *, walks: bool, waits: bool) -> None:
        """A gyro in another unit moves the estimated torso so much that a robot that stands falls.

        In a stand it has to show for some time: someone may shake the robot.
        """
        if self._absurd:
            self._absurd, self._passing = False, ""
        if self.trouble or not (walks or waits):
            self._samples.clear()
            return
        self._samples.append(np.append(frame.angular_velocity[:2], frame.linear_acceleration[:2]))
        if len(self._samples) < ABSURD_FIRST:
            return
        samples = np.array(self._samples)
        rates, forces = samples[:, :2], samples[:, 2:]
        # The median: one jolt is a fall or a shove.
        steps = np.sum(np.diff(rates, axis=0) ** 2, axis=1)
        turned = len(steps) * np.median(steps) / self._dt**2
        pressed = np.sum((forces - forces.mean(axis=0)) ** 2)
        if turned > ABSURD**2 * pressed and np.mean(np.sum(rates**2, axis=1)) > ABSURD_RATE**2:
            times = float(np.sqrt(turned / max(pressed, 1e-9)))
            text = (
                f"imu/data angular_velocity: turns by {times:.3g} rad/s^2 for each m/s^2 of the "
                f"accelerometer; allowed: {ABSURD:g}; deg/s instead of rad/s? The robot stands"
            )
            self._absurd_ticks += 1
            self._absurd = not walks and self._absurd_ticks < ABSURD_TICKS
            if self._absurd:
                self._passing = text
            else:
                self._final = text

    def _judge_axes(self, frame: SensorFrame, support: int) -> None:
        axes = self._axes
        if support == 0:
            axes.interrupt()
        elif not axes.done:
            axes.update(frame, support)
        if axes.trouble:
            self._final = (
                "imu/data: accelerometer, gyro and joints do not fit together in the first steps; "
                f"{axes.trouble} Mend it and start the sensors again; the robot stands"
            )

    def at_rest(self, frame: SensorFrame) -> SensorFrame:
        """The frame with an IMU that rests on the robot's soles; unchanged once it has fallen."""
        up, force = self._body.vertical(frame.joint_position), frame.linear_acceleration
        last = force if self._force is None else self._force
        self._force = last + self._dt / (FALLEN_TIME + self._dt) * (force - last)
        stood = self._stood
        self.fallen = (
            stood is not None
            and _size(stood) > FORCE_LEAST
            and min(_angle(self._force, up), _angle(self._force, stood)) > FALLEN_TILT
        )
        if self.fallen:
            return frame
        return frame._replace(
            linear_acceleration=GRAVITY * up, angular_velocity=np.zeros(3),
            mean_angular_velocity=None,
        )  # fmt: skip


def _size(vector: FloatArray) -> float:
    return hypot(*vector.tolist())


def _angle(a: FloatArray, b: FloatArray) -> float:
    size = _size(a) * _size(b)
    return acos(min(1.0, max(-1.0, float(a @ b) / size))) if size > 0.0 else 0.0
