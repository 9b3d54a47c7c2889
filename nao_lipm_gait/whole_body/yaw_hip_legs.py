"""Analytic inverse kinematics of legs with a yaw joint at the top of each hip.

Six joints meet six wanted values: position, normal and rotation of the sole. Seen from the sole,
the ankle roll puts the hip into the plane in which hip pitch, knee and ankle pitch move. The knee
follows from the distance, the ankle pitch from the direction, and the three hip angles from the
remaining rotation:

    R_sole = Rz(yaw) Rx(roll) Ry(hip pitch + knee + ankle pitch) Rx(ankle roll)
"""

from math import acos, asin, atan2, cos, hypot, pi, sin

from nao_lipm_gait.whole_body.body_model import SolePose
from nao_lipm_gait.whole_body.leg_kinematics import LegAngles, LegGeometry, LegSolution
from robot_core.types import Point3

SINGULAR = 1e-9
"""Length below which a direction is undefined; a leg turned sideways has one yaw-pitch axis."""


class YawHipLegs:
    """Both legs of a robot with a yaw joint in each hip.

    Args:
        geometry: Lengths of its legs.
    """

    def __init__(self, geometry: LegGeometry):
        self._thigh = geometry.thigh
        self._tibia = geometry.tibia
        self._foot_height = geometry.foot_height
        self._left_hip = geometry.left_hip
        self._right_hip = geometry.right_hip

    def solve(self, left: SolePose, right: SolePose, *, again: bool = False) -> LegSolution:
        """See `LegKinematics`; the rotation of each sole about its normal is exact too."""
        left_angles, left_reach = self._leg(left, self._left_hip)
        right_angles, right_reach = self._leg(right, self._right_hip)
        return LegSolution(left_angles, right_angles, 0.0, 0.0, max(left_reach, right_reach))

    def _leg(self, sole: SolePose, hip: Point3) -> tuple[LegAngles, float]:
        """Angles of one leg, and the distance by which the ankle is out of reach [m]."""
        px, py, pz = sole.position
        fx, fy, fz = sole.forward
        nx, ny, nz = sole.normal
        # The rotation of the sole has the columns f, l, n.
        lx, ly, lz = ny * fz - nz * fy, nz * fx - nx * fz, nx * fy - ny * fx
        foot = self._foot_height
        # From the ankle to the hip, seen from the sole.
        hx = hip[0] - px - foot * nx
        hy = hip[1] - py - foot * ny
        hz = hip[2] - pz - foot * nz
        x = fx * hx + fy * hy + fz * hz
        y = lx * hx + ly * hy + lz * hz
        z = nx * hx + ny * hy + nz * hz
        # The ankle rolls by less than a quarter turn, even if a deep knee puts the hip below it.
        up = hypot(y, z) if z >= 0.0 else -hypot(y, z)
        ankle_roll = atan2(y / up, z / up) if abs(up) > SINGULAR else 0.0
        knee, reach_error = self._knee(hypot(x, up))
        shin = atan2(-self._thigh * sin(knee), self._tibia + self._thigh * cos(knee))
        ankle_pitch = _wrapped(shin - atan2(x, up))

        # The hip makes the remaining rotation, R_sole Rx(-ankle roll) Ry(-(knee + ankle pitch)).
        c, s = cos(ankle_roll), sin(ankle_roll)
        # Columns after Rx(-ankle roll): f, c l - s n, s l + c n.
        mx, my, mz = c * lx - s * nx, c * ly - s * ny, c * lz - s * nz
        ux, uz = s * lx + c * nx, s * lz + c * nz
        pitch = knee + ankle_pitch
        c, s = cos(pitch), sin(pitch)
        ahead_z, above_z = c * fz + s * uz, c * uz - s * fz
        hip_roll = asin(min(max(mz, -1.0), 1.0))
        if hypot(mx, my) > SINGULAR:
            hip_yaw = atan2(-mx, my)
            hip_pitch = atan2(-ahead_z, above_z)
        else:
            hip_yaw = 0.0
            hip_pitch = atan2(c * ux - s * fx, c * fx + s * ux)
        angles = LegAngles(hip_yaw, hip_roll, hip_pitch, knee, ankle_pitch, ankle_roll)
        return angles, reach_error

    def _knee(self, reach: float) -> tuple[float, float]:
        """Knee angle [rad] for a distance of hip and ankle [m], and how far it is out of reach."""
        thigh, tibia = self._thigh, self._tibia
        if reach > thigh + tibia:
            return 0.0, reach - thigh - tibia
        if reach < abs(thigh - tibia):
            return pi, abs(thigh - tibia) - reach
        cosine = (reach * reach - thigh * thigh - tibia * tibia) / (2.0 * thigh * tibia)
        return acos(min(max(cosine, -1.0), 1.0)), 0.0


def _wrapped(angle: float) -> float:
    """The same angle within half a turn of zero."""
    return (angle + pi) % (2.0 * pi) - pi
