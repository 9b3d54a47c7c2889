"""Analytic inverse kinematics of the NAO's legs, whose hip yaw-pitch joints share one motor.

For a given hip yaw-pitch angle the other five joints of a leg reach any ankle position and any sole
normal in closed form. They cannot choose the rotation of the sole about its normal. One shared
angle serves two soles: the difference of the two rotations determines it, by a few secant steps.
The torso yaw, which is free, absorbs their mean.
"""

from math import acos, asin, atan2, copysign, cos, hypot, sin

from nao_lipm_gait.whole_body.body_model import SolePose
from nao_lipm_gait.whole_body.leg_kinematics import (
    SQRT_HALF,
    LegAngles,
    LegGeometry,
    LegSolution,
)
from robot_core.types import Point3

YAW_TOLERANCE = 1e-4
"""Largest difference of the two yaw errors [rad]."""
MAX_ITERATIONS = 8
_Leg = tuple[float, float, float, float, float, float, float]
YAW_ERROR, REACH_ERROR = 5, 6
"""Columns of a `_Leg`, after five joint angles. Plain tuples are the cheapest records."""


class SharedHipLegs:
    """Both legs of a NAO.

    Args:
        geometry: Lengths of its legs.
    """

    def __init__(self, geometry: LegGeometry):
        self._thigh = geometry.thigh
        self._tibia = geometry.tibia
        self._longest = self._thigh + self._tibia
        self._foot_height = geometry.foot_height
        self._left_hip = geometry.left_hip
        self._right_hip = geometry.right_hip
        self._last_hip_angle = self._hip_angle_before = 0.0
        self._last_slope = -2.0 * SQRT_HALF

    def solve(self, left: SolePose, right: SolePose, *, again: bool = False) -> LegSolution:
        """See `LegKinematics`; starts from the extrapolated hip angle and its last sensitivity."""
        angle = self._last_hip_angle
        if not again:
            angle = 2.0 * self._last_hip_angle - self._hip_angle_before
            self._hip_angle_before = self._last_hip_angle
        slope = self._last_slope
        left_leg = self._five_joints(angle, left, self._left_hip, 1.0)
        right_leg = self._five_joints(angle, right, self._right_hip, -1.0)
        previous: tuple[float, float] | None = None
        for _ in range(MAX_ITERATIONS):
            # The shared joint turns the soles against each other, by about sqrt(2) rad/rad.
            error = left_leg[YAW_ERROR] - right_leg[YAW_ERROR]
            if abs(error) < YAW_TOLERANCE:
                break
            if previous is not None and abs(angle - previous[0]) > 1e-9:
                slope = (previous[1] - error) / (angle - previous[0])
                slope = min(max(slope, -2.5), -0.5)
            previous = angle, error
            angle = min(max(angle + error / slope, -1.3), 1.0)
            left_leg = self._five_joints(angle, left, self._left_hip, 1.0)
            right_leg = self._five_joints(angle, right, self._right_hip, -1.0)
        self._last_hip_angle = angle
        self._last_slope = slope
        return LegSolution(
            LegAngles(angle, *left_leg[:YAW_ERROR]),
            LegAngles(angle, *right_leg[:YAW_ERROR]),
            left_leg[YAW_ERROR],
            right_leg[YAW_ERROR],
            max(left_leg[REACH_ERROR], right_leg[REACH_ERROR]),
        )

    def _five_joints(
        self, hip_angle: float, sole: SolePose, hip: Point3, side: float
    ) -> _Leg:
        """One leg for a given hip yaw-pitch.

        Args:
            hip_angle: Hip yaw-pitch [rad].
            sole: Wanted sole in the torso frame.
            hip: Intersection of the hip axes in the torso frame [m].
            side: +1 for the left leg, -1 for the right.

        Returns:
            Hip roll, hip pitch, knee, ankle pitch, ankle roll, yaw error [rad], reach error [m].
        """
        px, py, pz = sole.position
        dx, dy, dz = sole.forward
        nx, ny, nz = sole.normal
        hip_x, hip_y, hip_z = hip
        thigh, tibia, foot = self._thigh, self._tibia, self._foot_height
        # R, the hip yaw-pitch rotation by hip_angle about (0, 1, -side) / sqrt(2), has the rows
        # (c, s, t), (-s, h, -g), (-t, -g, h).
        c = cos(hip_angle)
        t = sin(hip_angle) * SQRT_HALF
        s = t * side
        h = 0.5 * (1.0 + c)
        g = 0.5 * (1.0 - c) * side
        vx = px + foot * nx - hip_x
        vy = py + foot * ny - hip_y
        vz = pz + foot * nz - hip_z
        ax = c * vx - s * vy - t * vz
        ay = s * vx + h * vy - g * vz
        az = t * vx - g * vy + h * vz
        mx = c * nx - s * ny - t * nz
        my = s * nx + h * ny - g * nz
        mz = t * nx - g * ny + h * nz

        hip_roll = atan2(ay, -az)
        lateral = hypot(ay, az)
        reach = hypot(ax, lateral)
        if reach > self._longest:
            reach_error = reach - self._longest
            knee = 0.0
        else:
            reach_error = 0.0
            cosine = (reach * reach - thigh * thigh - tibia * tibia) / (2.0 * thigh * tibia)
            knee = acos(cosine if -1.0 <= cosine <= 1.0 else copysign(1.0, cosine))
        # The thigh is ahead of the line from hip to ankle by the share that the knee bends back.
        hip_pitch = atan2(-ax, lateral) - atan2(tibia * sin(knee), thigh + tibia * cos(knee))
        cr = cos(hip_roll)
        sr = sin(hip_roll)
        normal_y = cr * my + sr * mz
        normal_z = cr * mz - sr * my
        ankle_roll = -asin(normal_y if -1.0 <= normal_y <= 1.0 else copysign(1.0, normal_y))
        pitch = atan2(mx, normal_z)
        ankle_pitch = pitch - hip_pitch - knee

        # The reached forward axis of the sole, in the torso frame.
        ux = cos(pitch)
        w = sin(pitch)
        uy = sr * w
        uz = -cr * w
        fx = c * ux + s * uy + t * uz
        fy = -s * ux + h * uy - g * uz
        fz = -t * ux - g * uy + h * uz
        yaw_error = atan2(
            (fy * dz - fz * dy) * nx + (fz * dx - fx * dz) * ny + (fx * dy - fy * dx) * nz,
            fx * dx + fy * dy + fz * dz,
        )
        return hip_roll, hip_pitch, knee, ankle_pitch, ankle_roll, yaw_error, reach_error
