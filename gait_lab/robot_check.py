"""`nao_gait robot check`: what a description says and lacks, where the robot can stand."""

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from gait_lab.analysis.body import shapes_of
from gait_lab.analysis.plots import BLUE, INK, RED, pyplot, save
from nao_lipm_gait.presets import DEFAULT, preset_for
from nao_lipm_gait.walks.base import BodyTargets, SoleTarget
from nao_lipm_gait.whole_body.body_model import BodyModel
from nao_lipm_gait.whole_body.com_placement import ComPlacement, PlacedBody
from nao_lipm_gait.whole_body.legs import make_legs
from nao_lipm_gait.whole_body.support_torque import Load, SupportTorque
from robot_core.errors import NaoGaitError
from robot_core.motion.joints import joint_groups
from robot_core.resources import share
from robot_core.robot import RobotDescription, load_robot
from robot_core.robot.derive import GEAR_SHARE
from robot_core.types import LEFT, RIGHT, FloatArray

HEIGHTS = 60
"""Heights of the CoM that are tried."""
RESERVE = 0.6
"""Share of a motor's torque on one leg above which it is noted: of twelve robots all that walk at
once stay below 0.55."""


class Effort(NamedTuple):
    """The motor that uses most of its torque.

    Attributes:
        torque: [N m].
        available: What it has there [N m].
    """

    joint: str
    torque: float
    available: float


class StandRange:
    """The heights of the CoM at which a robot can stand on both feet.

    Attributes:
        low: Lowest [m]; NaN if there is none.
        high: Highest [m].
        stand: The hardest motor in the stand pose.
        one_leg: The hardest motor in a step, when the left leg carries all and the CoM turns back.
    """

    def __init__(self, robot: RobotDescription) -> None:
        """Try all heights.

        Args:
            robot: The robot.
        """
        p = preset_for(robot, DEFAULT)
        half = 0.5 * robot.size * p.foot_spacing
        body, torques = BodyModel(robot), SupportTorque(robot)
        straight = _height(body, _straight(robot))
        reached = []

        def placed_at(height: float) -> PlacedBody:
            placement = ComPlacement(robot, body, make_legs(robot))
            com = (robot.size * p.foot_reference_x, 0.0, height)
            soles = SoleTarget(0.0, half, 0.0, 0.0), SoleTarget(0.0, -half, 0.0, 0.0)
            for _ in range(6):
                placed = placement.place(BodyTargets(com, *soles, 0.0, (0.0, 0.0, 0.0)))
            return placed

        for height in np.linspace(0.5, 1.0, HEIGHTS) * straight:
            placed = placed_at(float(height))
            q = placed.position
            inside = ((q >= robot.lower - 1e-6) & (q <= robot.upper + 1e-6)).all()
            off = abs(_height(body, q) - height)
            if placed.residual == 0.0 and inside and off < 0.01 * height:
                reached.append(float(height))
        self.low, self.high = (min(reached), max(reached)) if reached else (np.nan, np.nan)
        self.stand = _hardest(robot, torques.at(robot.stand_pose, 0.0, _under(robot, body)))
        q = placed_at(robot.size * p.com_height).position
        leg = Load(1.0, robot.size * p.foot_reference_x, aside=-p.pendulum_width / p.com_height)
        self.one_leg = _hardest(robot, torques.at(q, 0.0, (leg, Load(0.0))))


def _hardest(robot: RobotDescription, torque: FloatArray) -> Effort:
    limit = np.array([GEAR_SHARE * robot.motors[n].stall_torque for n in robot.joint_names])
    most = int(np.argmax(np.abs(torque) / limit))
    return Effort(robot.joint_names[most], abs(float(torque[most])), float(limit[most]))


def _under(robot: RobotDescription, body: BodyModel) -> tuple[Load, Load]:
    """Half of the weight on each sole, below the CoM."""
    x, _, _ = body.set_joints(robot.stand_pose)
    left, right = (x - body.sole_in_torso(side).position[0] for side in (1, -1))
    return Load(0.5, left), Load(0.5, right)


def _straight(robot: RobotDescription) -> FloatArray:
    pose = np.array(robot.stand_pose)
    pose[joint_groups(robot)["legs"]] = 0.0
    return pose


def _height(body: BodyModel, pose: FloatArray) -> float:
    """[m] of the CoM above the left sole."""
    _, _, z = body.set_joints(pose)
    return z - body.sole_in_torso(1).position[2]


def _standing(robot: RobotDescription) -> tuple[pin.Model, pin.Data]:
    """The robot in its stand pose."""
    model = pin.buildModelFromXML(robot.urdf, pin.JointModelFreeFlyer())
    data, q = model.createData(), pin.neutral(model)
    for name, angle in zip(robot.joint_names, robot.stand_pose.tolist(), strict=True):
        q[model.joints[model.getJointId(name)].idx_q] = angle
    pin.centerOfMass(model, data, q)
    pin.framesForwardKinematics(model, data, q)
    return model, data


def _ankle_height(robot: RobotDescription) -> float:
    """[m] of the lower ankle joint above the left sole; 0 if that is the frame of the ankle."""
    model, data = _standing(robot)
    sole = data.oMf[model.getFrameId(robot.sole_frames[0], pin.FrameType.BODY)]
    ankle = max(robot.left_leg.ankle, key=model.getJointId)
    return float(sole.actInv(data.oMi[model.getJointId(ankle)].translation)[2])


def _lines(robot: RobotDescription, stand: StandRange) -> Iterator[tuple[str, str]]:
    groups, index = joint_groups(robot), robot.joint_names
    body = BodyModel(robot)
    yield "robot", f"{robot.name}, {body.total_mass:.4g} kg, {len(index)} joints, {robot.urdf_path}"
    looked_for = f"none (looked for {robot.urdf_path.with_suffix('.yaml')})"
    yield "robot file", str(robot.robot_file or looked_for)
    yield "size", (
        f"{robot.size:.3g} of a NAO; CoM {_height(body, robot.stand_pose):.3g} m "
        "above the soles in its stand pose"
    )
    kinds = {"SharedHipLegs": "closed form, shared hip", "YawHipLegs": "closed form"}
    legs = kinds.get(type(make_legs(robot)).__name__, "numeric: offsets or another order")
    yield "legs", f"{legs}; left {', '.join(robot.left_leg.names)}"
    yield "head", ", ".join(robot.head or ()) or "none"
    yield "arms", ", ".join(index[i] for i in groups["left_arm"] + groups["right_arm"]) or "none"
    placed = {*groups["legs"], *groups["left_arm"], *groups["right_arm"], *groups["head"]}
    held = [name for i, name in enumerate(index) if i not in placed]
    yield "held", ", ".join(held) or "none"
    xs, ys = ([point[axis] for point in robot.sole_outline] for axis in (0, 1))
    yield "soles", (
        f"{1e3 * (max(xs) - min(xs)):.0f} x {1e3 * (max(ys) - min(ys)):.0f} mm, "
        f"{1e3 * max(xs):.0f} mm ahead and {-1e3 * min(xs):.0f} mm behind {robot.sole_frames[0]}, "
        f"{1e3 * _ankle_height(robot):.0f} mm below the ankle"
    )
    sensors = [f"IMU in {robot.imu_frame}", f"{robot.gyro_axes or 2} gyro axes"]
    sensors += [f"camera {name}" for name in robot.cameras]
    yield "sensors", ", ".join(sensors + ["forces under the soles"] * bool(robot.force_sensors))
    torques = [robot.motors[name].stall_torque for name in robot.left_leg.names]
    yield "motors", f"stall torques of a leg {min(torques):.3g} to {max(torques):.3g} N m"
    yield "from URDF", ", ".join(robot.from_urdf) or "nothing: the robot file has all"
    for remark in robot.remarks:
        yield "changed", remark
    yield "preset", robot.preset or "none: the NAO's, fitted to its soles and hips"
    motions = bool(robot.motions) and (share("config", "motions") / robot.motions).is_dir()
    yield "motions", robot.motions if motions else "none: it cannot get up or kick"
    yield "stands", (
        f"with its CoM {stand.low:.3g} to {stand.high:.3g} m high" if not math.isnan(stand.high)
        else "nowhere"
    )
    joint, torque, available = stand.one_leg
    used = torque / available
    note = ", too much to walk" if used > 1.0 else ", hardly enough" if used > RESERVE else ""
    yield "hardest", f"{joint}: {torque:.3g} of {available:.3g} N m on one leg{note}"


def _draw(robot: RobotDescription, stand: StandRange, path: Path) -> Path:
    """The robot in its stand pose from the front and from the left, with CoM and soles."""
    plt = pyplot()
    model, data = _standing(robot)
    com = data.com[0]
    soles = [data.oMf[model.getFrameId(s, pin.FrameType.BODY)] for s in robot.sole_frames]
    ground = min(float(sole.translation[2]) for sole in soles)
    shapes = shapes_of(robot.urdf)
    places = [data.oMf[model.getFrameId(n, pin.FrameType.BODY)] for n in shapes.links]
    points = np.array([places[k].act(v) for v, k in zip(shapes.vertex, shapes.link, strict=True)])
    figure, axes = plt.subplots(1, 2, figsize=(9, 6), sharey=True)
    views = (1, "front", "y [m], its left \u2192"), (0, "left", "\u2190 forward, x [m]")
    for axis, (across, view, label) in zip(axes, views, strict=True):
        if len(points):
            depth = points[shapes.triangle].mean(axis=1)[:, 1 - across]
            for triangle in np.argsort(depth):  # the nearest last
                corners = points[shapes.triangle[triangle]]
                color = shapes.color[triangle]
                axis.fill(corners[:, across], corners[:, 2] - ground, color=color, linewidth=0.0)
        for name in robot.joint_names:
            index = model.getJointId(name)
            bone = np.array([data.oMi[i].translation for i in (model.parents[index], index)])
            above = bone[:, 2] - ground
            axis.plot(bone[:, across], above, ".-", color=INK, linewidth=0.6, markersize=4)
        for sole, side in zip(soles, (LEFT, RIGHT), strict=True):
            corners = [np.array((x, side * y, 0.0)) for x, y in robot.sole_outline]
            outline = np.array([sole.act(corner) for corner in corners])
            axis.plot(outline[:, across], outline[:, 2] - ground, color=BLUE, linewidth=2)
        axis.plot(com[across], com[2] - ground, "o", color=RED)
        for height in (stand.low, stand.high):
            axis.axhline(height, color=RED, linewidth=0.6, linestyle="--")
        axis.set(title=f"seen from the {view}", xlabel=label, aspect="equal")
        axis.locator_params(axis="x", nbins=3)  # a view may be narrow
    axes[0].set_ylabel("height [m]")
    axes[1].invert_xaxis()
    figure.suptitle(f"{robot.name}: joints, soles (blue), CoM and where it can be (red)")
    return save(figure, path)


def check(file: str, out: Path | None, say: Callable[[str], None]) -> None:
    """Check a robot.

    Args:
        file: Shipped name, URDF or robot file.
        out: PNG to write; None = `out/NAME.png`.
        say: Prints a line.

    Raises:
        NaoGaitError: The robot cannot be loaded, cannot stand, or a motor is too weak for a stand.
    """
    robot = load_robot(file)
    stand = StandRange(robot)
    for key, text in _lines(robot, stand):
        say(f"{key:10} {text}")
    say(f"{'picture':10} {_draw(robot, stand, out or Path('out', f'{robot.name}.png'))}")
    if math.isnan(stand.high):
        allowed = "legs that put both soles flat below the CoM, inside the joint limits"
        raise NaoGaitError(f"stand of {robot.name}", "none", allowed)
    joint, torque, available = stand.stand
    if torque > available:
        raise NaoGaitError(
            f"motor of {joint}", f"{available:.3g} N m",
            f"at least {torque:.3g} N m, which the stand pose needs",
        )  # fmt: skip
