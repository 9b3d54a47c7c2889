"""An MJCF model as a URDF; MuJoCo reads it, so that classes, includes and angles are its own."""

import os
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from robot_core.errors import NaoGaitError
from robot_core.robot.urdf_model import LARGEST_URDF, MOST_LINKS, limited_xml
from robot_core.schema import read_bytes, read_text
from robot_core.types import FloatArray

GROWING = {"replicate", "composite", "flexcomp", "hfield", "skin"}
"""Elements that stand for any number of bodies, vertices or heights."""
UNUSED = ("textures", "sensors", "keys", "numerics", "texts", "tuples", "cameras", "lights")
"""Elements of a model that no URDF has; textures and sensors may be of any size."""
SIZES = (
    "memory", "nstack", "njmax", "nconmax", "nkey", "nuserdata", "nuser_body", "nuser_jnt",
    "nuser_geom", "nuser_site", "nuser_cam", "nuser_tendon", "nuser_actuator", "nuser_sensor",
)  # fmt: skip
"""What a model may ask memory for by a number."""
MOST_FILES, LARGEST_MESH, MOST_FACES = 50, 32 * 1024 * 1024, 1_000_000
"""Files of a model; [bytes] of one mesh; triangles of all its meshes."""
FACES, HULL = 150_000, 200
"""Triangles that are read at once, at up to 1.5 kB each: a model with more is read mesh by
mesh; vertices of the convex hull that is kept of each."""
SPEED = 10.0
"""[rad/s] Speed limit of the joints: an MJCF has none. The `motors` of a robot file know better."""


def urdf_of_mjcf(path: Path) -> str:
    """The URDF of the first body with a free joint, or of the first body, and all below it.

    Meshes become boxes around them. A joint's torque is its `actuatorfrcrange`, or what its
    actuator can give.

    Raises:
        NaoGaitError: MuJoCo is not installed or cannot read the file, or it has what no URDF has.
    """
    try:
        import mujoco
    except ImportError as error:
        raise NaoGaitError(f"MJCF {path}", "no MuJoCo", "pip install mujoco, or a URDF") from error
    _check_parts(path, path.parent, set())
    try:
        spec = mujoco.MjSpec.from_file(str(path))
        _reduce(spec, path)
        model = spec.compile()
    except NaoGaitError:
        raise
    except (ValueError, RuntimeError, MemoryError) as error:
        allowed = "a model that MuJoCo can read, such as the scene that includes this file"
        raise NaoGaitError(f"MJCF {path}", str(error), allowed) from error
    for number in range(model.neq):
        kind = mujoco.mjtEq(int(model.eq_type[number]))
        if kind in (mujoco.mjtEq.mjEQ_CONNECT, mujoco.mjtEq.mjEQ_WELD):
            where = f"equality {model.eq(number).name or number} in {path}"
            raise NaoGaitError(where, "a closed chain", "a tree of bodies, its loops cut open")
    free = [int(model.jnt_bodyid[j]) for j in range(model.njnt) if model.jnt_type[j] == 0]
    if model.nbody < 2:
        raise NaoGaitError(f"MJCF {path}", "no body", "a robot")
    root = free[0] if free else 1
    robot = ET.Element("robot", name=path.stem)
    inside = {root}
    for body in range(root, model.nbody):
        parent = int(model.body_parentid[body])
        if body == root or parent in inside:
            inside.add(body)
            _add_link(robot, model, body)
            if body != root:
                _add_joint(robot, model, body, parent, path)
    return ET.tostring(robot, encoding="unicode")


def _reduce(spec: Any, path: Path) -> None:
    """Take out of a model what no URDF has, before MuJoCo loads its files and takes its memory."""
    import mujoco

    for kind in UNUSED:
        for element in getattr(spec, kind):
            spec.delete(element)
    for material in spec.materials:
        material.textures = [""] * len(material.textures)
    usual = mujoco.MjSpec()
    for name in SIZES:
        setattr(spec, name, getattr(usual, name))
    total = 0
    for mesh in spec.meshes:
        mesh.maxhullvert = HULL
        faces = _faces(spec, mesh, path.parent)
        total += faces
        if faces > FACES:
            where = f"mesh {mesh.file} of {path}"
            raise NaoGaitError(where, f"{faces} triangles", f"at most {FACES}")
        if total > MOST_FACES:
            raise NaoGaitError(f"MJCF {path}", f"{total} triangles", f"at most {MOST_FACES}")
    if total > FACES:
        for mesh in spec.meshes:
            if mesh.file:
                _keep_hull(spec, mesh)


def _faces(spec: Any, mesh: Any, folder: Path) -> int:
    """Triangles of a mesh, or a few more; NaoGaitError if its file is too large."""
    name = Path(mesh.file).name if spec.strippath else mesh.file
    most = 0
    for file in {folder / spec.meshdir / name, folder / name}:
        if mesh.file and os.path.exists(file):  # MuJoCo says which one does not
            data = read_bytes(file, "mesh", LARGEST_MESH)
            obj = file.suffix.lower() == ".obj"
            most = max(most, data.count(b"f ") if obj else len(data) // 50)
    return most


def _keep_hull(spec: Any, mesh: Any) -> None:
    """Replace a mesh by the convex hull around it, of which MuJoCo makes the same box."""
    import mujoco

    alone = mujoco.MjSpec()
    alone.modelfiledir, alone.meshdir, alone.strippath = (
        spec.modelfiledir, spec.meshdir, spec.strippath
    )  # fmt: skip
    alone.add_mesh(
        name="mesh", file=mesh.file, scale=mesh.scale, refpos=mesh.refpos, refquat=mesh.refquat,
        maxhullvert=HULL,
    )  # fmt: skip
    alone.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="mesh")
    model = alone.compile()
    count = int(model.mesh_graph[0])  # then faces, an address for each vertex, and its number
    vertices = np.asarray(model.mesh_vert, dtype=float)[model.mesh_graph[2 + count : 2 + 2 * count]]
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, model.mesh_quat[0])
    points = vertices @ turn.reshape(3, 3).T + model.mesh_pos[0]
    mesh.file, mesh.uservert = "", points.ravel()
    mesh.scale, mesh.refpos, mesh.refquat = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)


def _check_parts(path: Path, folder: Path, seen: set[Path]) -> None:
    """Limit a file and those that it includes before MuJoCo reads them.

    Args:
        path: The file.
        folder: That of the first one, where included files are.
        seen: The files so far; this one is added.
    """
    where = f"MJCF {path}"
    seen.add(path)
    if len(seen) > MOST_FILES:
        raise NaoGaitError(where, f"{len(seen)} files", f"at most {MOST_FILES} included files")
    bodies = 0
    for element in limited_xml(read_text(path, "MJCF", LARGEST_URDF), where).iter():
        bodies += element.tag == "body"
        if element.tag in GROWING:
            raise NaoGaitError(where, f"<{element.tag}>", "bodies that are written out")
        if element.tag in ("include", "model"):
            inner = folder / element.get("file", "")
            if inner not in seen:
                _check_parts(inner, folder, seen)
    if bodies > MOST_LINKS:
        raise NaoGaitError(where, f"{bodies} bodies", f"at most {MOST_LINKS}")


def _hinge(model: Any, body: int) -> int | None:
    """The joint that moves a body."""
    return int(model.body_jntadr[body]) if model.body_jntnum[body] else None


def _anchor(model: Any, body: int) -> FloatArray:
    """(3,) [m] of the link's frame in that of the body: where its hinge is."""
    joint = _hinge(model, body)
    if joint is None or model.jnt_type[joint] == 0:
        return np.zeros(3)
    return np.asarray(model.jnt_pos[joint])


def _add_link(robot: ET.Element, model: Any, body: int) -> None:
    link = ET.SubElement(robot, "link", name=model.body(body).name)
    anchor = _anchor(model, body)
    if model.body_mass[body] > 0.0:
        inertial = ET.SubElement(link, "inertial")
        _origin(inertial, model.body_ipos[body] - anchor, model.body_iquat[body])
        ET.SubElement(inertial, "mass", value=repr(float(model.body_mass[body])))
        x, y, z = map(float, model.body_inertia[body])
        ET.SubElement(
            inertial, "inertia", ixx=repr(x), iyy=repr(y), izz=repr(z), ixy="0", ixz="0", iyz="0"
        )
    first = int(model.body_geomadr[body])
    for geom in range(first, first + int(model.body_geomnum[body])):
        paired = geom in model.pair_geom1 or geom in model.pair_geom2
        meets = paired or bool(model.geom_contype[geom] or model.geom_conaffinity[geom])
        for tag in ("visual", "collision") if meets else ("visual",):
            _add_shape(link, tag, model, geom, anchor)


def _add_shape(link: ET.Element, tag: str, model: Any, geom: int, anchor: FloatArray) -> None:
    import mujoco

    kind, size = mujoco.mjtGeom(int(model.geom_type[geom])), model.geom_size[geom]
    place, turn = np.asarray(model.geom_pos[geom]) - anchor, model.geom_quat[geom]
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, turn)
    rotation = matrix.reshape(3, 3)
    if kind in (mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD):
        return
    element = ET.SubElement(link, tag)
    geometry = ET.SubElement(element, "geometry")
    if kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        ET.SubElement(geometry, "sphere", radius=repr(float(size[0])))
    elif kind in (mujoco.mjtGeom.mjGEOM_CYLINDER, mujoco.mjtGeom.mjGEOM_CAPSULE):
        length = 2.0 * float(size[1])
        if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
            length += 2.0 * float(size[0])
        ET.SubElement(geometry, "cylinder", radius=repr(float(size[0])), length=repr(length))
    elif kind == mujoco.mjtGeom.mjGEOM_MESH:
        # In the axes of the body: those of the mesh are its axes of inertia, in which a sole tilts.
        mesh = int(model.geom_dataid[geom])
        first = int(model.mesh_vertadr[mesh])
        points = model.mesh_vert[first : first + int(model.mesh_vertnum[mesh])] @ rotation.T
        low, high = points.min(axis=0), points.max(axis=0)
        place, turn = place + 0.5 * (low + high), np.array((1.0, 0.0, 0.0, 0.0))
        ET.SubElement(geometry, "box", size=_words(high - low))
    else:  # a box, or the box around an ellipsoid
        centre, half = model.geom_aabb[geom][:3], model.geom_aabb[geom][3:]
        place = place + rotation @ centre
        ET.SubElement(geometry, "box", size=_words(2.0 * half))
    _origin(element, place, turn)
    red, green, blue, alpha = map(float, model.geom_rgba[geom])
    material = ET.SubElement(element, "material", name=f"color_{geom}")
    ET.SubElement(material, "color", rgba=f"{red:.4g} {green:.4g} {blue:.4g} {alpha:.4g}")


def _add_joint(robot: ET.Element, model: Any, body: int, parent: int, path: Path) -> None:
    name, joint = model.body(body).name, _hinge(model, body)
    if model.body_jntnum[body] > 1:
        joints = [model.joint(int(model.body_jntadr[body]) + i).name for i in range(2)]
        allowed = "one hinge a body: put a body between them"
        raise NaoGaitError(f"body {name} in {path}", f"joints {', '.join(joints)}", allowed)
    hinged = joint is not None
    if hinged and model.jnt_type[joint] != 3:
        raise NaoGaitError(f"joint {model.joint(joint).name} in {path}", "no hinge", "hinges")
    element = ET.SubElement(
        robot, "joint", name=model.joint(joint).name if hinged else f"{name}_fixed",
        type="revolute" if hinged else "fixed",
    )  # fmt: skip
    import mujoco

    turned = np.empty(3)
    mujoco.mju_rotVecQuat(turned, _anchor(model, body), model.body_quat[body])
    _origin(element, model.body_pos[body] + turned - _anchor(model, parent), model.body_quat[body])
    ET.SubElement(element, "parent", link=model.body(parent).name)
    ET.SubElement(element, "child", link=name)
    if joint is not None:
        low, high = map(float, model.jnt_range[joint])
        if not model.jnt_limited[joint]:
            low, high = -np.pi, np.pi
        ET.SubElement(element, "axis", xyz=_words(model.jnt_axis[joint]))
        torque = max(_torques(model, joint), default=0.0)
        ET.SubElement(
            element, "limit", lower=repr(low), upper=repr(high), effort=repr(torque),
            velocity=repr(SPEED),
        )  # fmt: skip


def _torques(model: Any, joint: int) -> Iterator[float]:
    """What may limit a joint's torque [N m]; the smallest range that the model gives."""
    if model.jnt_actfrclimited[joint]:
        yield float(model.jnt_actfrcrange[joint][1])
        return
    for actuator in range(model.nu):
        if model.actuator_trnid[actuator][0] == joint and model.actuator_trntype[actuator] == 0:
            gear = abs(float(model.actuator_gear[actuator][0]))
            if model.actuator_forcelimited[actuator]:
                yield gear * float(model.actuator_forcerange[actuator][1])
            elif model.actuator_ctrllimited[actuator] and not model.actuator_biastype[actuator]:
                gain = float(model.actuator_gainprm[actuator][0])
                yield gear * gain * float(model.actuator_ctrlrange[actuator][1])


def _words(values: FloatArray) -> str:
    return " ".join(repr(float(value)) for value in values)


def _origin(element: ET.Element, place: FloatArray, quaternion: FloatArray) -> None:
    import pinocchio as pin

    w, x, y, z = map(float, quaternion)
    # Not by arcsin and arctan2: bodies are often turned by 90 deg about y, where these are noise.
    rpy = pin.rpy.matrixToRpy(pin.Quaternion(w, x, y, z).normalized().matrix())
    ET.SubElement(element, "origin", xyz=_words(place), rpy=_words(rpy))
