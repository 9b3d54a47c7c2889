"""Joints as they wear: rotors, servo stiffness, play, dry friction; only MuJoCo has them."""

import math

import numpy as np
import pinocchio as pin
import pytest

from engine_bench import (
    HIGH,
    Bench,
    UrdfModel,
    changed,
    walked,
    weightless,
)
from robot_core.errors import NaoGaitError
from robot_core.geometry import rotation_matrix
from robot_core.robot import RobotDescription
from robot_core.types import JointTargets
from sim_bridge.engines.backend import make_robot_model
from sim_bridge.individual import NOMINAL
from sim_bridge.plant import Plant, load_plant
from sim_bridge.world import World


def mujoco_bench(robot: RobotDescription, plant: Plant) -> Bench:
    bench = Bench("mujoco", robot, plant)
    bench.float()
    return bench


@pytest.mark.usefixtures("mujoco_only")
def test_mass_matrix_is_pinocchio_s_plus_the_rotors(
    robot: RobotDescription, reference: Plant
) -> None:
    """Exact, where free fall leaves room for a wrong small number."""
    import mujoco

    from sim_bridge.engines.mujoco.model import MujocoModel

    model = MujocoModel([make_robot_model(robot, reference, NOMINAL)]).model
    data = mujoco.MjData(model)
    joints = np.random.default_rng(1).uniform(robot.lower, robot.upper)
    for name, angle in zip(robot.joint_names, joints, strict=True):
        data.joint(name).qpos[:] = angle
    mujoco.mj_forward(model, data)
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    columns = [int(model.joint(name).dofadr[0]) for name in robot.joint_names]
    own = (full - np.diag(model.dof_armature))[np.ix_(columns, columns)]
    by_pinocchio = UrdfModel(robot)
    q = pin.neutral(by_pinocchio.model)
    for joint, angle in zip(by_pinocchio.columns, joints, strict=True):
        q[joint.idx_q] = angle
    expected = pin.crba(by_pinocchio.model, by_pinocchio.data, q)
    expected = np.triu(expected) + np.triu(expected, 1).T
    rows = [joint.idx_v for joint in by_pinocchio.columns]
    assert own == pytest.approx(expected[np.ix_(rows, rows)], abs=1e-9)
    assert full[0, 0] == pytest.approx(by_pinocchio.mass, abs=1e-9)


@pytest.mark.usefixtures("mujoco_only")
def test_a_servo_sags_by_torque_over_stiffness(robot: RobotDescription, reference: Plant) -> None:
    plant = changed(reference, motor={"stiffness": 150.0})
    with World.single(robot, plant, robot_seed=NOMINAL, engine="mujoco") as world:
        for _ in range(200):
            world.step()
        truth = world.robot.truth()
    for joint in ("LKneePitch", "RKneePitch", "LAnklePitch", "LHipRoll"):
        index = robot.index(joint)
        sag = robot.stand_pose[index] - truth.joint_position[index]
        assert sag == pytest.approx(truth.joint_torque[index] / 150.0, abs=1e-5)
    assert abs(truth.joint_torque[robot.index("LKneePitch")]) > 0.3


@pytest.mark.usefixtures("mujoco_only")
def test_play_is_free_and_no_wider(robot: RobotDescription, reference: Plant) -> None:
    """A foot that is pushed to either side of its play goes that far while its motor stays."""
    import mujoco

    from sim_bridge.engines.mujoco.model import MujocoModel
    from sim_bridge.engines.mujoco.robot import play_name

    play = 0.04
    plant = changed(weightless(reference), motor={"play": play})
    model = MujocoModel([make_robot_model(robot, plant, NOMINAL)]).model
    for side in (1.0, -1.0):
        data = mujoco.MjData(model)
        data.qpos[:3] = HIGH
        for name, angle in zip(robot.joint_names, robot.stand_pose, strict=True):
            data.joint(name).qpos[:] = angle
            data.actuator(name).ctrl[:] = angle
        data.joint(play_name("LAnklePitch")).qvel[:] = side * 0.5
        seen = []
        for _ in range(60):
            mujoco.mj_step(model, data)
            seen.append(side * data.joint(play_name("LAnklePitch")).qpos[0])
        assert max(seen) == pytest.approx(play / 2.0, abs=0.1 * play)


@pytest.mark.usefixtures("mujoco_only")
def test_inside_the_play_the_foot_is_free(
    robot: RobotDescription, reference: Plant
) -> None:
    bench = mujoco_bench(robot, changed(weightless(reference), motor={"play": 0.04}))
    index = bench.set("RAnklePitch", robot.stand_pose[robot.index("RAnklePitch")] + 0.01)
    before = bench.observe()
    for _ in range(50):
        state = bench.step()
    # the motor has gone 0.01 rad; the foot, in the middle of the play, need not follow
    assert abs(state.joint_position[index] - before.joint_position[index]) < 0.004
    bench.set("RAnklePitch", robot.stand_pose[index] + 0.05)
    for _ in range(100):
        state = bench.step()
    moved = state.joint_position[index] - before.joint_position[index]
    assert 0.05 - 0.021 < moved < 0.05 + 0.021  # taken along, and free to coast


@pytest.mark.usefixtures("mujoco_only")
@pytest.mark.parametrize("encoder_feedback", [False, True])
def test_a_servo_that_sees_the_encoder_takes_up_the_play(
    robot: RobotDescription, reference: Plant, encoder_feedback: bool
) -> None:
    """A knee under load rests at one end of its play; its torque shows the servo's error."""
    motor = {"stiffness": 150.0, "play": 0.04, "encoder_feedback": encoder_feedback}
    plant = changed(reference, motor=motor)
    knees = [robot.index(joint) for joint in ("LKneePitch", "RKneePitch")]
    with World.single(robot, plant, robot_seed=NOMINAL, engine="mujoco") as world:
        for _ in range(300):
            world.step()
        truth = world.robot.truth()
    error = (robot.stand_pose - truth.joint_position)[knees]
    left = np.abs(error - truth.joint_torque[knees] / 150.0)
    assert np.abs(truth.joint_torque[knees]).min() > 0.3
    if encoder_feedback:
        assert left.max() < math.tau / 2**12
    else:
        assert left == pytest.approx(0.02, abs=1e-3)


@pytest.mark.usefixtures("mujoco_only")
@pytest.mark.parametrize("encoder_feedback", [False, True])
def test_encoder_steps_reach_the_servo(
    robot: RobotDescription, reference: Plant, encoder_feedback: bool
) -> None:
    """With 64 steps per turn no reading is 0.03 rad.

    The joint goes to where the reading changes from too small to too large, half a step from 0.
    """
    plant = changed(
        weightless(reference),
        motor={"encoder_feedback": encoder_feedback},
        sensors={"encoder_bits": 6},
    )
    bench = mujoco_bench(robot, plant)
    index = bench.set("HeadYaw", 0.03)
    angles = [bench.step().joint_position[index] for _ in range(400)][200:]
    expected = math.tau / 64 / 2.0 if encoder_feedback else 0.03
    assert np.mean(angles) == pytest.approx(expected, abs=0.003)


@pytest.mark.usefixtures("mujoco_only")
@pytest.mark.parametrize(("friction", "holds"), [(0.0, False), (0.3, True)])
def test_dry_friction_holds_a_relaxed_foot(
    robot: RobotDescription, reference: Plant, friction: float, holds: bool
) -> None:
    """Lying on the back, a foot weighs less than its ankle's friction."""
    plant = changed(reference, motor={"friction": friction})
    with World.single(
        robot, plant, robot_seed=NOMINAL, engine="mujoco", start_state="lying_back"
    ) as world:
        target = np.array(robot.stand_pose)
        for _ in range(20):
            world.robot.command(JointTargets(world.time, target, 1.0))
            world.step()
        index = robot.index("LAnklePitch")
        before = world.robot.truth().joint_position[index]
        for _ in range(60):
            world.robot.command(JointTargets(world.time, target, 0.0))
            world.step()
        moved = abs(world.robot.truth().joint_position[index] - before)
    assert (moved < 0.01) == holds
    if not holds:
        assert moved > 0.05


@pytest.mark.usefixtures("mujoco_only")
def test_armature_is_the_rotor_s_inertia_at_the_joint(
    robot: RobotDescription, reference: Plant
) -> None:
    speeds = []
    for factor in (1.0, 4.0):
        motor = {"armature": factor, "torque_speed_line": False}
        bench = mujoco_bench(robot, changed(weightless(reference), motor=motor))
        index = bench.set("HeadYaw", 2.0)
        for _ in range(5):
            state = bench.step()
        speeds.append(state.joint_velocity[index])
    model = pin.buildModelFromXML(robot.urdf)
    data = model.createData()
    pin.crba(model, data, pin.neutral(model))
    joint = model.joints[model.getJointId("HeadYaw")].idx_v
    head, rotor = data.M[joint, joint], robot.motors["HeadYaw"].reflected_inertia
    expected = (head + 4.0 * rotor) / (head + rotor)
    assert speeds[0] / speeds[1] == pytest.approx(expected, rel=0.05)


@pytest.mark.usefixtures("mujoco_only")
@pytest.mark.parametrize(
    ("section", "option", "value", "allowed"),
    [
        ("motor", "lag", 0.001, r"0 or at least 0\.004 s"),
        ("motor", "stiffness", 5000.0, r"at most 342\.5 N m/rad"),
        ("motor", "armature", 0.1, r"at least 0\.5 or null"),
        ("physics", "step", 0.005, r"at most 0\.004 s"),
    ],
)
def test_mujoco_refuses_what_it_cannot_honour(
    robot: RobotDescription,
    reference: Plant,
    section: str,
    option: str,
    value: float,
    allowed: str,
) -> None:
    plant = changed(reference, **{section: {option: value}})
    with pytest.raises(NaoGaitError, match=rf"{option}: got {value}; allowed: {allowed}"):
        World.single(robot, plant, engine="mujoco")


@pytest.mark.usefixtures("mujoco_only")
def test_the_worn_plant_stands(robot: RobotDescription) -> None:
    with World.single(robot, load_plant("worn"), robot_seed=0, engine="mujoco") as world:
        for _ in range(200):
            world.step()
        truth = world.robot.truth()
    tilt = np.degrees(np.linalg.norm(pin.log3(rotation_matrix(truth.torso_quaternion))))
    assert tilt < 3.0
    assert truth.sole_force.min() > 10.0


@pytest.mark.usefixtures("mujoco_only")
@pytest.mark.parametrize("number", range(3))
def test_the_walk_bears_the_worn_plant(number: int) -> None:
    """At the full speed of worn joints; at that of sound ones some robots fall on them."""
    assert walked("forward=33", "mujoco", "worn", number) > 0.3
