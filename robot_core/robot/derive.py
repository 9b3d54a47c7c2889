"""What a robot file leaves out, as its URDF has it: legs, head and arms, soles, motors, a stand.

A leg is a chain of six joints that ends in a foot; hip, knee and ankle are told apart by their
axes in the zero pose, in which the robot looks along x. The soles are the lowest part of the
collision shapes of the feet, if these are level there.
"""

import itertools
import math
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from robot_core.errors import NaoGaitError
from robot_core.robot.shape_points import lowest_points
from robot_core.robot.urdf_model import driven_model
from robot_core.types import FloatArray, Point2

LEG_JOINTS = 6
HIP_ROLES = ("hip_yaw", "hip_roll", "hip_pitch")
AXIS_OF = {
    "hip_yaw": 2, "hip_roll": 0, "hip_pitch": 1, "knee_pitch": 1, "ankle_pitch": 1, "ankle_roll": 0,
}  # fmt: skip
"""Component of a joint's axis by its role."""
MIRROR_TOLERANCE = 0.02
"""[m] Distance of a joint from the mirror image of its partner."""
GEAR_SHARE = 0.7
"""Share of a motor's stall torque that reaches its joint, for which a URDF gives the effort."""
ROTOR_INERTIA = 1e-3
"""[kg m^2 / (N m)] Reflected inertia per stall torque: 0.9e-3 to 1.1e-3 in NAO, K1, T1 and OP3."""
ARM_JOINTS = 3
"""Joints of an arm at least; eyes have fewer."""
APART = 0.2
"""[rad] Of the arms of a stand from the vertical."""
KNEE = 0.8
"""[rad] Bend of the knees in a stand."""
BEND_MIN = 0.3
"""[rad] Middle of a knee's range from which on the side is clear to which it bends."""
LEVEL = 1e-3
"""[rad] Tilt of a level sole."""
IN_PLANE = 0.01, 0.1
"""[m], [rad] Of a link off the plane of the sole below it from which on it is that of the foot."""
DAMPING = 1e-6 * np.eye(6)
"""Of the steps towards level soles."""
REFERENCE_HEIGHT = 0.274
"""[m] Height of a NAO's CoM (H21 V3.3) over straight legs, as `relative_size` measures it."""
SOLES = ("l_sole", "r_sole")
"""Names of sole links that are added."""
HIPS = "base_at_hips"
"""Name of the root that is added where the description's looks back, or lies at the feet."""


@dataclass(frozen=True, slots=True)
class _Joint:
    """A driven joint in the zero pose.

    Attributes:
        axis: (3,) in the axes of the root.
        position: (3,) [m] in the frame of the root.
    """

    above: tuple[str, ...]
    axis: FloatArray
    position: FloatArray


class RobotTree:
    """The driven joints of a URDF in its zero pose; all others count as fixed."""

    def __init__(self, element: ET.Element, driven: Iterable[str], path: Path) -> None:
        import pinocchio as pin

        self.model = model = driven_model(deepcopy(element), driven, path)
        self._data = data = model.createData()
        pin.computeJointJacobians(model, data, pin.neutral(model))
        pin.updateFramePlacements(model, data)
        children = {_end(joint, "child") for joint in element.findall("joint")}
        links = [link.get("name", "") for link in element.findall("link")]
        self.root = next(name for name in links if name not in children)
        self.joints: dict[str, _Joint] = {}
        for index in range(2, model.njoints):
            above = [model.names[i] for i in model.supports[index].tolist() if i > 1]
            jacobian = pin.getJointJacobian(model, data, index, pin.ReferenceFrame.WORLD)
            self.joints[model.names[index]] = _Joint(
                tuple(above),
                np.array(jacobian[3:, model.joints[index].idx_v]),
                data.oMi[index].translation.copy(),
            )

    def placement(self, link: str) -> Any:
        """Pose of a link in the root, as an SE3."""
        import pinocchio as pin

        return self._data.oMf[self.model.getFrameId(link, pin.FrameType.BODY)]

    def mover(self, link: str) -> str:
        """The driven joint that moves a link; empty for the root."""
        import pinocchio as pin

        index = self.model.frames[self.model.getFrameId(link, pin.FrameType.BODY)].parentJoint
        return str(self.model.names[index]) if index > 1 else ""

    def links_of(self, joint: str) -> list[str]:
        """The links that are fixed to what a joint moves."""
        import pinocchio as pin

        index = self.model.getJointId(joint)
        return [
            frame.name for frame in self.model.frames
            if frame.type == pin.FrameType.BODY and frame.parentJoint == index
        ]  # fmt: skip


def partners(tree: RobotTree) -> dict[str, str]:
    """The joint on the other side of each joint; a joint in the middle is its own partner.

    Partners lie at mirrored places and turn about mirrored axes, as many joints below the root.
    """
    found = {}
    for name, joint in tree.joints.items():
        best, distance = name, math.inf
        x, y, z = joint.axis
        for other, twin in tree.joints.items():
            if len(twin.above) != len(joint.above) or abs(np.dot((-x, y, -z), twin.axis)) < 0.99:
                continue
            apart = float(np.linalg.norm(twin.position - joint.position * (1.0, -1.0, 1.0)))
            if apart < min(distance - 1e-9, MIRROR_TOLERANCE):
                best, distance = other, apart
        found[name] = best
    return found


def completed(
    values: Mapping[str, Any], element: ET.Element, path: Path
) -> dict[str, Any]:
    """The keys of a robot file with those that it leaves out.

    Args:
        values: The keys that the file has.
        element: The URDF; sole links are added to it where it has none.
        path: Its file, for error messages.

    Returns:
        All keys that a robot file must have.

    Raises:
        NaoGaitError: The URDF does not tell one of them.
    """
    out = dict(values)
    out.setdefault("name", element.get("name") or path.stem)
    out.setdefault("joints", driven_joints(element, path))
    whole = all(key in out for key in ("left_leg", "right_leg", "frames", "sole_outline", "motors",
                                       "stand_pose", "head", "shoulder_pitch"))  # fmt: skip
    if whole and _names_a_leg(out["stand_pose"], (out["left_leg"], out["right_leg"])):
        return _simple(out)
    tree = RobotTree(element, out["joints"], path)
    frames = dict(out.get("frames") or {})
    legs = _legs(out, element, tree, frames, path)
    back = _looks_back(element, tree, legs[0]["knee_pitch"])
    if back or tree.joints[legs[0]["knee_pitch"]].position[2] > 0.0:
        _add_root(element, tree, legs, yaw=math.pi if back else 0.0)
        tree = RobotTree(element, out["joints"], path)
        legs = _legs(out, element, tree, frames, path)
    for key, leg in zip(("left_leg", "right_leg"), legs, strict=True):
        out.setdefault(key, leg)
    root = [tree.root]
    for role in ("base", "torso", "imu"):
        frames.setdefault(role, root)
    if all(_has(element, sole) for sole in SOLES):
        for key, sole in zip(("left_sole", "right_sole"), SOLES, strict=True):
            frames.setdefault(key, [sole])
    named = "left_sole" in frames and "right_sole" in frames
    if not named or ("sole_outline" not in out and _above_sole(element, tree, legs, frames, path)):
        outline = _add_soles(element, tree, legs, path)
        frames["left_sole"], frames["right_sole"] = [SOLES[0]], [SOLES[1]]
        out.setdefault("sole_outline", outline)
        tree = RobotTree(element, out["joints"], path)
    elif "sole_outline" not in out:
        name = next(each for each in frames["left_sole"] if _has(element, each))
        out["sole_outline"] = _outline(element, tree, legs[0], name, path)
    out["frames"] = frames
    out.setdefault("motors", _motors(element, out["joints"]))
    _add_roles(out, tree)
    given = out.get("stand_pose", {})
    if not _names_a_leg(given, legs):
        arms = {**_nearest_zero(tree), **_hanging(tree, out.get("shoulder_roll"))}
        arms.update((name, angle) for name, angle in given.items() if name in tree.joints)
        out["stand_pose"] = {**arms, **_stand(tree, legs, frames, arms, path), **given}
    return _simple(out)


def _names_a_leg(pose: object, legs: Iterable[object]) -> bool:
    """Whether a stand pose says how the legs stand, or is no pose, which is refused later.

    Legs are given or derived as a whole: a knee alone would neither balance nor level the soles.
    """
    if not isinstance(pose, Mapping):
        return True
    joints = [name for leg in legs if isinstance(leg, Mapping) for name in leg.values()]
    if not all(isinstance(angle, int | float) and math.isfinite(angle) for angle in pose.values()):
        return True
    return any(name in joints for name in pose)


def _simple(out: dict[str, Any]) -> dict[str, Any]:
    """Defaults that need no geometry of the joints."""
    out.setdefault("coupled_joints", [])
    outline = out["sole_outline"]
    if "sole_corners" not in out and isinstance(outline, list):
        out["sole_corners"] = corners_of(outline)
    return out


def corners_of(outline: list[list[float]]) -> list[list[float]]:
    """Front inner, front outer, rear outer and rear inner point of a left sole's outline."""
    size_x, size_y = (max(p[i] for p in outline) - min(p[i] for p in outline) for i in (0, 1))
    diagonals = ((1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0))
    return [
        max(outline, key=lambda p: ahead * p[0] / size_x + aside * p[1] / size_y)
        for ahead, aside in diagonals
    ]


def _end(joint: ET.Element, tag: str) -> str:
    element = joint.find(tag)
    return "" if element is None else element.get("link", "")


def _has(element: ET.Element, link: str) -> bool:
    return any(each.get("name") == link for each in element.findall("link"))


def driven_joints(element: ET.Element, path: Path) -> list[str]:
    """All revolute joints with an own range, in the order of the URDF."""
    names = []
    for joint in element.findall("joint"):
        limit = joint.find("limit")
        own = limit is not None and limit.get("lower", "0") != limit.get("upper", "0")
        if joint.get("type") == "revolute" and own and joint.find("mimic") is None:
            names.append(joint.get("name", ""))
    if not names:
        raise NaoGaitError(f"URDF {path}", "no revolute joint", "two legs of six revolute joints")
    return names


def _legs(
    values: Mapping[str, Any], element: ET.Element, tree: RobotTree, frames: Mapping[str, Any],
    path: Path,
) -> tuple[dict[str, str], dict[str, str]]:
    """Joints of the left and the right leg by role."""
    if "left_leg" in values and "right_leg" in values:
        return values["left_leg"], values["right_leg"]
    feet = [_foot(tree, frames.get(key), side) for key, side in
            (("left_sole", 1.0), ("right_sole", -1.0))]  # fmt: skip
    chains = [tree.joints[foot].above if foot else () for foot in feet]
    shared = [a for a, b in zip(*chains, strict=False) if a == b]
    legs = []
    for side, chain in zip(("left", "right"), chains, strict=True):
        leg = chain[len(shared) :]
        if len(leg) != LEG_JOINTS:
            held = ", ".join(_without_range(element, tree, leg))
            beside = f"; not driven: {held}" if held else ""
            got = f"{len(leg)} joints: {', '.join(leg)}" if leg else f"no foot on the {side}"
            raise NaoGaitError(
                f"{side} leg of {path}", f"{got}{beside}",
                "six joints from the hip to the foot, x of the root ahead or back and z up; name "
                "left_leg and right_leg in the robot file if other joints are meant",
            )  # fmt: skip
        legs.append(_roles(leg, tree, side, path))
    return legs[0], legs[1]


def _without_range(element: ET.Element, tree: RobotTree, leg: tuple[str, ...]) -> list[str]:
    """Joints above and below those of a leg that move but cannot be driven, with their type."""
    moves = {_end(joint, "child"): joint for joint in element.findall("joint")}

    def above(joint: ET.Element | None) -> list[str]:
        names = []
        while joint is not None:
            names.append(joint.get("name", ""))
            joint = moves.get(_end(joint, "parent"))
        return names

    chains = {joint.get("name", ""): above(joint) for joint in moves.values()}
    lowest = leg[-1] if leg else ""
    return [
        f"{name} ({joint.get('type')})" for joint in moves.values()
        if joint.get("type") != "fixed" and (name := joint.get("name", "")) not in tree.joints
        and (lowest in chains[name] or name in chains.get(lowest, ()))
    ]  # fmt: skip


def _looks_back(element: ET.Element, tree: RobotTree, knee: str) -> bool:
    """The knees bend the shanks ahead of the thighs, by the axes of the root: it points back."""
    limit = next(
        joint.find("limit") for joint in element.findall("joint") if joint.get("name") == knee
    )
    if limit is None:
        return False
    try:
        middle = 0.5 * (float(limit.get("lower", 0)) + float(limit.get("upper", 0)))
    except ValueError:
        return False  # the limits are refused where they are read
    return tree.joints[knee].axis[1] * middle < -BEND_MIN


def _add_root(
    element: ET.Element, tree: RobotTree, legs: tuple[Mapping[str, str], ...], yaw: float
) -> None:
    """Add a root between the hips, in whose axes the present one is turned by a yaw [rad]."""
    import pinocchio as pin

    hips = [tree.joints[leg["hip_pitch"]].position for leg in legs]
    middle = pin.rpy.rpyToMatrix(0.0, 0.0, yaw) @ (0.5 * (hips[0] + hips[1]))
    ET.SubElement(element, "link", name=HIPS)
    joint = ET.SubElement(element, "joint", name=f"{HIPS}_fixed", type="fixed")
    ET.SubElement(joint, "parent", link=HIPS)
    ET.SubElement(joint, "child", link=tree.root)
    xyz = " ".join(map(repr, (-middle).tolist()))
    ET.SubElement(joint, "origin", xyz=xyz, rpy=f"0 0 {yaw!r}")


def _foot(tree: RobotTree, frame: Any, side: float) -> str:
    """The joint that moves a foot: that of a link, else the lowest end of a chain on its side."""
    names = [frame] if isinstance(frame, str) else list(frame or ())
    for name in names:
        if tree.model.existFrame(name):
            return tree.mover(name)
    inner = {above for joint in tree.joints.values() for above in joint.above[:-1]}
    ends = [
        name for name, joint in tree.joints.items()
        if name not in inner and side * joint.position[1] > 0.0
    ]  # fmt: skip
    return min(ends, key=lambda name: tree.joints[name].position[2], default="")


def _roles(
    leg: tuple[str, ...], tree: RobotTree, side: str, path: Path
) -> dict[str, str]:
    """The joints of a leg by role: three of the hip, the knee, two of the ankle, by their axes."""
    axes = [np.abs(tree.joints[name].axis) for name in leg]
    hip, knee, ankle = leg[:3], leg[3], leg[4:]

    def fit(roles: tuple[str, ...], first: int) -> float:
        return float(sum(axes[first + i][AXIS_OF[role]] for i, role in enumerate(roles)))

    hips = max(itertools.permutations(HIP_ROLES), key=lambda roles: fit(roles, 0))
    ankles = max((("ankle_pitch", "ankle_roll"), ("ankle_roll", "ankle_pitch")),
                 key=lambda roles: fit(roles, 4))  # fmt: skip
    found = dict(zip((*hips, "knee_pitch", *ankles), (*hip, knee, *ankle), strict=True))
    for role, joint in found.items():
        if abs(tree.joints[joint].axis[AXIS_OF[role]]) < 0.5:
            allowed = "hip yaw, roll and pitch in any order, then a knee, then ankle pitch and roll"
            raise NaoGaitError(
                f"{side} leg of {path}", f"{', '.join(leg)}, none of them a {role}", allowed
            )
    return {role: found[role] for role in AXIS_OF}


def _foot_points(
    element: ET.Element, tree: RobotTree, leg: Mapping[str, str], path: Path
) -> FloatArray:
    """(n, 3) [m] points of the sole in the frame of the root: the lowest of the foot's shapes."""
    foot = max(leg.values(), key=lambda name: len(tree.joints[name].above))
    links = {name: tree.placement(name) for name in tree.links_of(foot)}
    points = lowest_points(element, links, path)
    if len(points) < 3:
        raise NaoGaitError(
            f"sole of what joint {foot} moves in {path}", "no collision shape with a flat bottom",
            "a box under the foot, or sole links and a sole_outline in the robot file",
        )  # fmt: skip
    return points


def _above_sole(
    element: ET.Element, tree: RobotTree, legs: tuple[Mapping[str, str], ...],
    frames: Mapping[str, Any], path: Path,
) -> bool:
    """The left sole is named by a link that is not in its plane, such as that of the foot.

    Where the description has links of `SOLES`, these or the named ones are taken as they are.
    """
    name = next((each for each in frames["left_sole"] if _has(element, each)), None)
    if name is None:
        links = " or ".join(frames["left_sole"])
        raise NaoGaitError(f"link {links} in {path}", "missing", "a link")
    if any(_has(element, sole) for sole in SOLES):
        return False
    place, (height, tilt) = tree.placement(name), IN_PLANE
    low = float(_foot_points(element, tree, legs[0], path)[:, 2].min())
    off, level = abs(low - float(place.translation[2])), float(place.rotation[2, 2])
    return off > height or level < math.cos(tilt)


def _outline(
    element: ET.Element, tree: RobotTree, leg: Mapping[str, str], sole: str, path: Path
) -> list[list[float]]:
    place = tree.placement(sole)
    points = (_foot_points(element, tree, leg, path) - place.translation) @ place.rotation
    return _hull([(x, y) for x, y, _ in points.tolist()])


def _ankle(tree: RobotTree, leg: Mapping[str, str]) -> FloatArray:
    """(3,) [m] The point of the roll axis nearest to the pitch axis, in the frame of the root.

    The origin of a joint may be anywhere on its axis, such as at the front of the foot.
    """
    pitch, roll = tree.joints[leg["ankle_pitch"]], tree.joints[leg["ankle_roll"]]
    axes = np.column_stack((roll.axis, -pitch.axis))
    along = np.linalg.lstsq(axes, pitch.position - roll.position, rcond=None)[0][0]
    return roll.position + along * roll.axis


def _add_soles(
    element: ET.Element, tree: RobotTree, legs: tuple[Mapping[str, str], ...], path: Path
) -> list[list[float]]:
    """Add a link in the plane of each sole, below the ankle; the outline of the left one."""
    import pinocchio as pin

    outline: list[list[float]] = []
    for name, leg in zip(SOLES, legs, strict=True):
        points = _foot_points(element, tree, leg, path)
        foot = max(leg.values(), key=lambda each: len(tree.joints[each].above))
        origin = np.array([*_ankle(tree, leg)[:2], points[:, 2].min()])
        if not outline:
            outline = _hull([(x, y) for x, y, _ in (points - origin).tolist()])
        link = tree.links_of(foot)[0]
        local = tree.placement(link).inverse()
        ET.SubElement(element, "link", name=name)
        joint = ET.SubElement(element, "joint", name=f"{name}_fixed", type="fixed")
        ET.SubElement(joint, "parent", link=link)
        ET.SubElement(joint, "child", link=name)
        rpy = pin.rpy.matrixToRpy(local.rotation).tolist()
        ET.SubElement(
            joint, "origin", xyz=" ".join(map(repr, local.act(origin).tolist())),
            rpy=" ".join(map(repr, rpy)),
        )  # fmt: skip
    return outline


def _hull(points: list[Point2]) -> list[list[float]]:
    """The convex hull, counter-clockwise, of points rounded to 0.1 mm."""
    rest = sorted({(round(x, 4), round(y, 4)) for x, y in points})

    def half(row: Iterable[Point2]) -> list[Point2]:
        chain: list[Point2] = []
        for x, y in row:
            while len(chain) > 1:
                (ax, ay), (bx, by) = chain[-2:]
                if (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 1e-9:
                    break
                chain.pop()
            chain.append((x, y))
        return chain[:-1]

    return [[x, y] for x, y in half(rest) + half(reversed(rest))]


def _motors(element: ET.Element, joints: Iterable[str]) -> list[dict[str, Any]]:
    """A motor for each joint from the limits of the URDF."""
    limits = {joint.get("name"): joint.find("limit") for joint in element.findall("joint")}
    motors = []
    for name in joints:
        limit = limits.get(name)
        try:
            effort = float(limit.get("effort", "")) if limit is not None else math.nan
            speed = float(limit.get("velocity", "")) if limit is not None else math.nan
        except ValueError:
            continue  # the limits are refused where they are read
        stall = effort / GEAR_SHARE
        motors.append({
            "joints": [name], "stall_torque": stall, "no_load_speed": speed,
            "reflected_inertia": ROTOR_INERTIA * stall,
        })  # fmt: skip
    return motors


def _add_roles(out: dict[str, Any], tree: RobotTree) -> None:
    """Head and shoulders, where the file does not name them: by place and axis."""
    of_legs = {*out["left_leg"].values(), *out["right_leg"].values()}
    twin = partners(tree)
    above_legs = {each for leg in of_legs for each in tree.joints[leg].above}
    free = {name: joint for name, joint in tree.joints.items() if name not in above_legs}
    sided = {name for name in free if twin[name] != name}
    hands = [name for name in sided if len(sided.intersection(free[name].above)) >= ARM_JOINTS]
    waist = {each for name in hands for each in free[name].above} - sided
    middle = [name for name in free if twin[name] == name and name not in waist]
    for pan, tilt in itertools.product(middle, middle):
        chained = free[tilt].above[-2:] == (pan, tilt)
        if chained and abs(free[pan].axis[2]) > 0.9 and abs(free[tilt].axis[1]) > 0.9:
            out.setdefault("head", [pan, tilt])
    arms = {name: joint for name, joint in free.items()
            if twin[name] != name and joint.position[1] > 0.0}  # fmt: skip
    for key, axis in (("shoulder_pitch", 1), ("shoulder_roll", 0)):
        fits = [name for name, joint in arms.items() if abs(joint.axis[axis]) > 0.9]
        if fits and key not in out:
            first = min(fits, key=lambda name: len(arms[name].above))
            out[key] = [first, twin[first]]


def _nearest_zero(tree: RobotTree) -> dict[str, float]:
    """The joints that cannot be at zero, as near to it as they can."""
    model, pose = tree.model, {}
    for name in tree.joints:
        index = model.joints[model.getJointId(name)].idx_q
        low, high = model.lowerPositionLimit[index], model.upperPositionLimit[index]
        if not low <= 0.0 <= high:
            pose[name] = float(low if low > 0.0 else high)
    return pose


def _hanging(tree: RobotTree, shoulders: Iterable[str] | None) -> dict[str, float]:
    """Shoulder rolls with which the arms hang, a little apart from the body."""
    import pinocchio as pin

    model = tree.model
    data, pose = model.createData(), {}
    for name in shoulders or ():
        index = model.joints[model.getJointId(name)].idx_q
        low, high = model.lowerPositionLimit[index], model.upperPositionLimit[index]

        def height(angle: float, index: int = index) -> float:
            q = pin.neutral(model)
            q[index] = angle
            return float(pin.centerOfMass(model, data, q)[2])

        lowest = min(np.linspace(low, high, 60).tolist(), key=height)
        pose[name] = lowest - math.copysign(min(APART, abs(lowest)), lowest)
    return pose


def _stand(
    tree: RobotTree, legs: tuple[dict[str, str], ...], frames: Mapping[str, Any],
    arms: Mapping[str, float], path: Path,
) -> dict[str, float]:
    """A stand with level soles on bent knees and the CoM over the middle of the ankles' soles."""
    import pinocchio as pin

    model = tree.model
    data, q = model.createData(), pin.neutral(model)
    soles = [
        next(name for name in frames[key] if model.existFrame(name))
        for key in ("left_sole", "right_sole")
    ]
    frame = model.getFrameId(soles[0], pin.FrameType.BODY)
    ahead = 0.0
    pose: dict[str, float] = {}
    for name, angle in arms.items():
        q[model.joints[model.getJointId(name)].idx_q] = angle
    for _ in range(30):
        # Hip pitch moves the foot under the CoM; the ankle keeps the sole level.
        for leg in legs:
            bend = {
                "hip_pitch": ahead - KNEE / 2.0, "knee_pitch": KNEE,
                "ankle_pitch": -ahead - KNEE / 2.0,
            }  # fmt: skip
            for role, angle in bend.items():
                sign = math.copysign(1.0, tree.joints[leg[role]].axis[1])
                index = model.joints[model.getJointId(leg[role])].idx_q
                low, high = model.lowerPositionLimit[index], model.upperPositionLimit[index]
                pose[leg[role]] = float(min(max(sign * angle, low), high))
                q[index] = pose[leg[role]]
        com = pin.centerOfMass(model, data, q)
        pin.framesForwardKinematics(model, data, q)
        place = data.oMf[frame]
        off = float(com[0] - place.translation[0])
        if abs(off) < 1e-5:
            break
        ahead -= 0.8 * off / max(float(com[2] - place.translation[2]), 1e-3)
    else:
        raise NaoGaitError(f"stand of {path}", f"CoM {off:.3f} m off the soles", "a stand_pose")
    return {**pose, **_levelled(tree, legs, soles, q, path)}


def _levelled(
    tree: RobotTree, legs: tuple[dict[str, str], ...], soles: list[str], q: FloatArray, path: Path
) -> dict[str, float]:
    """Leg joints that make the soles level, as wide as in the zero pose and below the CoM.

    None are needed where all axes are parallel to those of the root and the zero pose has level
    soles. `q` is the stand without them.
    """
    import pinocchio as pin

    model = tree.model
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    frames = [model.getFrameId(sole, pin.FrameType.BODY) for sole in soles]

    def tilt() -> float:
        return max(float(np.hypot(*data.oMf[frame].rotation[2, :2])) for frame in frames)

    if tilt() < LEVEL:
        return {}
    height = float(np.mean([data.oMf[frame].translation[2] for frame in frames]))
    joints = [[model.joints[model.getJointId(name)] for name in leg.values()] for leg in legs]
    for _ in range(60):
        ahead = float(pin.centerOfMass(model, data, q)[0])
        for sole, frame, leg in zip(soles, frames, joints, strict=True):
            pin.computeJointJacobians(model, data, q)
            pin.updateFramePlacements(model, data)
            place = np.array((ahead, tree.placement(sole).translation[1], height))
            error = pin.log6(data.oMf[frame].actInv(pin.SE3(np.eye(3), place))).vector
            jacobian = pin.getFrameJacobian(model, data, frame, pin.ReferenceFrame.LOCAL)
            jacobian = jacobian[:, [joint.idx_v for joint in leg]]
            step = jacobian.T @ np.linalg.solve(jacobian @ jacobian.T + DAMPING, error)
            for joint, change in zip(leg, step.tolist(), strict=True):
                low, high = (
                    limit[joint.idx_q]
                    for limit in (model.lowerPositionLimit, model.upperPositionLimit)
                )
                q[joint.idx_q] = min(max(q[joint.idx_q] + change, low), high)
    pin.framesForwardKinematics(model, data, q)
    if tilt() > LEVEL:
        raise NaoGaitError(f"stand of {path}", "soles that are not level", "a stand_pose")
    return {name: float(q[model.joints[model.getJointId(name)].idx_q])
            for leg in legs for name in leg.values()}  # fmt: skip


def relative_size(values: Mapping[str, Any], element: ET.Element, path: Path) -> float:
    """The height of a robot's CoM over straight legs relative to the NAO's.

    Args:
        values: The keys of its robot file, none left out.
        element: Its URDF.
        path: Its file, for error messages.
    """
    import pinocchio as pin

    tree = RobotTree(element, values["joints"], path)
    model = tree.model
    data, q = model.createData(), pin.neutral(model)
    for name, angle in values["stand_pose"].items():
        q[model.joints[model.getJointId(name)].idx_q] = angle
    com = pin.centerOfMass(model, data, q)
    roles = ("hip_pitch", "knee_pitch", "ankle_pitch")
    hip, knee, ankle = (
        data.oMi[model.getJointId(values["left_leg"][role])].translation for role in roles
    )
    zero = [tree.joints[values["left_leg"][role]].position for role in roles]
    sole = next(s for s in values["frames"]["left_sole"] if model.existFrame(s))
    foot = float(np.linalg.norm(zero[2] - tree.placement(sole).translation))
    leg = float(np.linalg.norm(hip - knee) + np.linalg.norm(knee - ankle))
    return (float(com[2] - hip[2]) + leg + foot) / REFERENCE_HEIGHT
