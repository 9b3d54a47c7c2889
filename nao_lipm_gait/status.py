"""The state of the gait as one record, for topics, bags and figures."""

from nao_lipm_gait.estimation.state_estimator import StateEstimator
from nao_lipm_gait.walks.base import BodyTargets, SoleTarget, Walk
from robot_core.geometry import ORIGIN, compose, relative
from robot_core.types import LEFT, GaitState, GaitStatus, Pose2, Pose6

_NO_POSE: Pose6 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def make_status(
    stamp: int,
    state: GaitState,
    walk: Walk,
    estimator: StateEstimator,
    targets: BodyTargets | None,
    *,
    com_height: float,
    ik_residual: float,
    clipped_joints: int,
    motion: str,
    blocked: bool,
) -> GaitStatus:
    """The status after a tick.

    Args:
        stamp: Stamp [ns] of the sensor frame of the tick.
        state: Mode of the gait.
        walk: The walk, also while it stands.
        estimator: State of the robot.
        targets: Targets of the last tick that had some; None before.
        com_height: Height [m] of the pendulum's mass, as the parameters say.
        ik_residual: Largest distance [m] of a sole from its target.
        clipped_joints: Number of targets that were clipped at a joint limit.
        motion: Name of the running motion, or empty.
        blocked: The robot walks against something.
    """
    expected, estimated, odometry = walk.expected, walk.estimated, estimator.odometry
    # The walk only knows its Qs relative to each other; the odometry places them in odom.
    q_in_odom = compose(odometry.support_sole_in_odom, relative(ORIGIN, estimated.sole_in_q))
    left = right = _NO_POSE
    if targets is not None:
        predicted = relative(targets.q_in_odom, estimated.q_in_odom)
        predicted_q_in_odom = compose(q_in_odom, predicted)
        left = _in_odom(predicted_q_in_odom, targets.left_sole)
        right = _in_odom(predicted_q_in_odom, targets.right_sole)
    single = "left" if estimated.support == LEFT else "right"
    return GaitStatus(
        stamp=stamp,
        state=state,
        support="double" if walk.stopping else single,
        com_expected_in_q=(expected.x, expected.y, com_height),
        com_measured_in_q=estimator.com_in_q,
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
        torso_roll=estimator.orientation.roll,
        torso_pitch=estimator.orientation.pitch,
        ik_residual=ik_residual,
        clipped_joints=clipped_joints,
        motion=motion,
        pose_covariance=estimator.pose_covariance,
        yaw_rate_variance=estimator.yaw_rate_variance,
        blocked=blocked,
    )


def _in_odom(q_in_odom: Pose2, sole: SoleTarget) -> Pose6:
    x, y, yaw = compose(q_in_odom, (sole.x, sole.y, sole.yaw))
    return x, y, sole.z, sole.roll, sole.pitch, yaw
