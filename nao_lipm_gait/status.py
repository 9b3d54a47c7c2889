"""The snapshot of a gait that topics, bags and figures show."""

from nao_lipm_gait.estimation.state_estimator import StateEstimator
from nao_lipm_gait.geometry import compose, relative
from nao_lipm_gait.types import LEFT, GaitState, GaitStatus, Pose2, Pose6
from nao_lipm_gait.walks.base import BodyTargets, SoleTarget, Walk

_NOWHERE: Pose2 = (0.0, 0.0, 0.0)
_UNPLACED: Pose6 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def snapshot(
    stamp: int,
    state: GaitState,
    walk: Walk,
    senses: StateEstimator,
    targets: BodyTargets | None,
    com_height: float,
    *,
    ik_residual: float,
    clipped_joints: int,
    motion: str,
) -> GaitStatus:
    """`targets`: of the last tick, None before any; com_height [m]: as the pendulum has it."""
    expected, estimated, odometry = walk.expected, walk.estimated, senses.odometry
    # The walk's own chain of Qs only orders them; where they are is the odometry's to say.
    q_in_odom = compose(odometry.support_sole_in_odom, relative(_NOWHERE, estimated.sole_in_q))
    left = right = _UNPLACED
    if targets is not None:
        ahead = relative(targets.q_in_odom, estimated.q_in_odom)
        command_q_in_odom = compose(q_in_odom, ahead)
        left = _in_odom(command_q_in_odom, targets.left_sole)
        right = _in_odom(command_q_in_odom, targets.right_sole)
    single = "left" if estimated.support == LEFT else "right"
    return GaitStatus(
        stamp=stamp,
        state=state,
        support="double" if walk.stopping else single,
        com_expected_in_q=(expected.x, expected.y, com_height),
        com_measured_in_q=senses.com_in_q,
        com_estimated_in_q=(estimated.x, estimated.y, com_height),
        pendulum_origin_in_q=walk.origin_in_q,
        step_size=walk.step_size,
        step_count=estimated.step_count,
        time_to_support_change=walk.time_left,
        q_in_odom=q_in_odom,
        base_footprint_in_odom=odometry.base_footprint_in_odom,
        velocity=odometry.velocity,
        left_sole_in_odom=left,
        right_sole_in_odom=right,
        torso_roll=senses.orientation.roll,
        torso_pitch=senses.orientation.pitch,
        ik_residual=ik_residual,
        clipped_joints=clipped_joints,
        motion=motion,
    )


def _in_odom(q_in_odom: Pose2, sole: SoleTarget) -> Pose6:
    x, y, yaw = compose(q_in_odom, (sole.x, sole.y, sole.yaw))
    return x, y, sole.z, sole.roll, sole.pitch, yaw
