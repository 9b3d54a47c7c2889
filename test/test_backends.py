"""What every physics engine has to show before anyone believes a walk in it.

Black box wherever possible: masses, inertias and torques are judged by how the robot moves, against
Pinocchio on the same URDF, not by asking the engine what it was told.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator

import numpy as np
import pinocchio as pin
import pytest

from gait_lab.rollout import RolloutSpec, rollout
from gait_lab.tasks import TASKS
from nao_lipm_gait.errors import NaoGaitError
from nao_lipm_gait.robot_description import RobotDescription, load_robot
from nao_lipm_gait.signals import FloatArray, JointTargets
from sim_bridge import engines
from sim_bridge.backend import Backend, StartState, TrueState
from sim_bridge.body import Body
from sim_bridge.individual import NOMINAL, draw_individual
from sim_bridge.motors import TorqueLimits
from sim_bridge.plant import Plant, load_plant
from sim_bridge.simulation import Simulation
from sim_bridge.vectors import rotation_matrix

G = 9.81
STILL = np.zeros(3)
TUMBLED = np.array([0.3, -0.2, 0.5, math.sqrt(1.0 - 0.38)])
"""A torso rotation without any symmetry."""
HIGH = np.array([0.4, -0.3, 3.0])


@pytest.fixture(params=engines.ENGINES)
def engine(request: pytest.FixtureRequest) -> str:
    if not engines.installed(request.param):
        pytest.skip(f"{request.param} is not installed")
    return str(request.param)


@pytest.fixture(scope="module")
def robot() -> RobotDescription:
    return load_robot()


@pytest.fixture(scope="module")
def reference() -> Plant:
    return load_plant("reference")


def changed(plant: Plant, **sections: dict[str, object]) -> Plant:
    """The plant with some options of some sections replaced."""
    return dataclasses.replace(
        plant,
        **{
            name: dataclasses.replace(getattr(plant, name), **options)
            for name, options in sections.items()
        },
    )


def weightless(plant: Plant) -> Plant:
    return changed(plant, physics={"gravity": 0.0})


class Bench:
    """A nominal robot on a backend, without setpoint handling, sensors or delay."""

    def __init__(self, engine: str, robot: RobotDescription, plant: Plant, seed: int = NOMINAL):
        individual = draw_individual(plant, robot, seed)
        self.robot, self.plant = robot, plant
        self.body = Body(robot, individual)
        self.limits = TorqueLimits(robot, plant, individual)
        self.backend: Backend = engines.make_backend(engine, robot, plant, individual, self.body)
        self.setpoint = np.array(robot.stand_pose)

    def float(self, rotation: FloatArray = TUMBLED) -> TrueState:
        """High above the floor."""
        self.setpoint = np.array(self.robot.stand_pose)
        self.backend.reset(StartState(HIGH, rotation, self.setpoint))
        return self.backend.observe()

    def step(self, push: FloatArray = STILL, stiffness: float = 1.0) -> TrueState:
        self.backend.step(self.setpoint, stiffness, push)
        return self.backend.observe()

    def set(self, joint: str, angle: float) -> int:
        index = self.robot.index(joint)
        self.setpoint[index] = angle
        return index

    def com(self, state: TrueState) -> FloatArray:
        rotation = rotation_matrix(state.torso_rotation)
        return self.body.pose(state.torso_position, rotation, state.joint_position).com


@pytest.fixture
def floating(engine: str, robot: RobotDescription, reference: Plant) -> Iterator[Bench]:
    bench = Bench(engine, robot, weightless(reference))
    yield bench
    bench.backend.close()


def swing(bench: Bench, step: int) -> None:
    """All joints in motion, inside their limits."""
    count = len(bench.setpoint)
    phase = 9.0 * step * bench.plant.physics.step + np.arange(count)
    share = 0.3 * np.sin(phase) * min(1.0, step * bench.plant.physics.step / 0.1)
    for leader, follower in bench.robot.coupled_joints:
        share[bench.robot.index(follower)] = share[bench.robot.index(leader)]
    pose = np.array(bench.robot.stand_pose) + share
    bench.setpoint = np.clip(pose, bench.robot.lower + 0.05, bench.robot.upper - 0.05)


class UrdfModel:
    """The robot by Pinocchio alone; the URDF's root and the torso frame coincide in this robot."""

    def __init__(self, robot: RobotDescription) -> None:
        self.model = pin.buildModelFromXML(robot.urdf, pin.JointModelFreeFlyer())
        self.data = self.model.createData()
        self.columns = [self.model.joints[self.model.getJointId(j)] for j in robot.joint_names]

    def momentum(self, state: TrueState) -> FloatArray:
        """(6,) about the centre of mass, in world axes."""
        q, v = pin.neutral(self.model), np.zeros(self.model.nv)
        rotation = rotation_matrix(state.torso_rotation)
        q[:3], q[3:7] = state.torso_position, state.torso_rotation
        v[:3], v[3:6] = rotation.T @ state.torso_linear_velocity, state.torso_angular_velocity
        for joint, angle, speed in zip(
            self.columns, state.joint_position, state.joint_velocity, strict=True
        ):
            q[joint.idx_q], v[joint.idx_v] = angle, speed
        return np.array(pin.computeCentroidalMomentum(self.model, self.data, q, v))

    @property
    def mass(self) -> float:
        return float(sum(inertia.mass for inertia in self.model.inertias))


def test_standing_weight_and_centre_of_pressure_are_those_of_the_urdf(
    engine: str, robot: RobotDescription, reference: Plant
) -> None:
    with Simulation(robot, reference, robot_seed=NOMINAL, engine=engine) as simulation:
        for _ in range(150):
            simulation.step(None)
        reading, truth = simulation._line.newest(10**12), simulation.truth()
        assert truth.sole_force.sum() == pytest.approx(UrdfModel(robot).mass * G, rel=1e-3)
        assert reading is not None
        pressure, total = np.zeros(2), 0.0
        for sole, wrench in zip(truth.soles, reading.sole_wrench, strict=True):
            force = sole.rotation @ wrench[:3]
            torque = sole.rotation @ wrench[3:] + np.cross(sole.position, force)
            pressure += (-torque[1], torque[0])
            total += force[2]
        assert pressure / total == pytest.approx(truth.com[:2], abs=1e-3)


def test_joints_swinging_in_free_fall_leave_the_centre_of_mass_on_its_parabola(
    engine: str, robot: RobotDescription, reference: Plant
) -> None:
    """Wrong masses or centres of mass of any link would make it wobble."""
    bench = Bench(engine, robot, reference, seed=3)
    state = bench.float()
    start, step, steps = bench.com(state), reference.physics.step, 150
    wobble = travel = 0.0
    for count in range(1, steps + 1):
        swing(bench, count)
        state = bench.step()
        # semi-implicit Euler falls by g t (t + dt) / 2
        fall = G * step * step * count * (count + 1) / 2.0
        wobble = max(wobble, float(np.linalg.norm(bench.com(state) + [0.0, 0.0, fall] - start)))
        travel = max(travel, float(np.linalg.norm(state.joint_position - robot.stand_pose)))
    bench.backend.close()
    assert travel > 0.5
    assert wobble < 5e-4


def test_swinging_in_free_fall_conserves_angular_momentum(floating: Bench) -> None:
    """Wrong inertias of any link would show."""
    state, model = floating.float(), UrdfModel(floating.robot)
    largest = moved = 0.0
    for count in range(1, 101):
        swing(floating, count)
        state = floating.step()
        momentum = model.momentum(state)[3:]
        largest = max(largest, float(np.linalg.norm(momentum)))
        moved = max(moved, float(np.abs(state.joint_velocity).max()))
    assert moved > 2.0
    assert largest < 5e-3


def test_standing_sinks_by_weight_over_stiffness(
    engine: str, robot: RobotDescription, reference: Plant
) -> None:
    with Simulation(robot, reference, robot_seed=NOMINAL, engine=engine) as simulation:
        for _ in range(150):
            simulation.step(None)
        truth = simulation.truth()
    points = 8.0
    middle = [
        sole.position + sole.rotation @ np.mean(contact.points, axis=0)
        for sole, contact in zip(truth.soles, simulation.body.soles, strict=True)
    ]
    depth = 0.005 - float(np.mean([point[2] for point in middle]))
    expected = simulation.body.mass * G / (points * reference.contact.stiffness)
    assert depth == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("joint", ["HeadYaw", "LElbowRoll", "RKneePitch", "LAnkleRoll"])
def test_a_joint_follows_a_step_with_the_lag_of_the_plant(floating: Bench, joint: str) -> None:
    floating.float()
    before = floating.robot.stand_pose[floating.robot.index(joint)]
    way = -0.05 if joint == "LElbowRoll" else 0.05
    index = floating.set(joint, before + way)
    step, shares = floating.plant.physics.step, [0.0]
    for _ in range(60):
        shares.append((floating.step().joint_position[index] - before) / way)
    reached = 1.0 - math.exp(-1.0)
    late = next(i for i, share in enumerate(shares) if share >= reached)
    time = (late - (shares[late] - reached) / (shares[late] - shares[late - 1])) * step
    assert time == pytest.approx(floating.plant.motor.lag, abs=0.004)
    assert max(shares) < 1.08
    assert shares[-1] == pytest.approx(1.0, abs=0.02)


def test_torque_reaches_its_cap_and_never_passes_it(floating: Bench) -> None:
    """The knee runs into its end stop: from standstill to its top speed, and stopped by force."""
    floating.float()
    index = floating.set("RKneePitch", 3.0)
    cap = 0.7 * floating.robot.motors["RKneePitch"].stall_torque
    state, torques, excess = floating.backend.observe(), [], 0.0
    for _ in range(400):
        velocity = state.joint_velocity
        state = floating.step()
        torques.append(state.joint_torque[index])
        driving = state.joint_torque * velocity > 0.0
        limit = np.where(driving, floating.limits.driving(velocity), floating.limits.standstill)
        excess = max(excess, float((np.abs(state.joint_torque) - limit).max()))
    assert state.joint_position[index] > floating.robot.upper[index] - 0.02
    assert excess < 0.01 * cap  # at top speed PyBullet may drive where it is about to brake
    assert max(torques) == pytest.approx(cap, rel=1e-6)


def test_the_cap_is_what_really_moves_the_joint(
    engine: str, robot: RobotDescription, reference: Plant
) -> None:
    """Reported torques prove nothing: engines have limits of their own that act later."""
    plant = changed(weightless(reference), motor={"torque_speed_line": False})
    bench = Bench(engine, robot, plant)
    bench.float()
    index = bench.set("HeadYaw", 2.0)
    steps = 5
    for _ in range(steps):
        state = bench.step()
    bench.backend.close()
    motor = robot.motors["HeadYaw"]
    model = pin.buildModelFromXML(robot.urdf)
    data = model.createData()
    pin.crba(model, data, pin.neutral(model))
    joint = model.joints[model.getJointId("HeadYaw")].idx_v
    rotor = motor.reflected_inertia if engine == "mujoco" else 0.0
    inertia = data.M[joint, joint] + rotor
    expected = 0.7 * motor.stall_torque * steps * plant.physics.step / inertia
    relative = state.joint_velocity[index]
    assert relative == pytest.approx(expected, rel=0.1)


def test_a_relaxed_motor_puts_out_nothing(floating: Bench) -> None:
    floating.float()
    index = floating.set("LElbowRoll", -1.0)
    for _ in range(50):
        state = floating.step(stiffness=0.0)
    assert state.joint_torque == pytest.approx(np.zeros(len(state.joint_torque)), abs=1e-9)
    assert abs(state.joint_position[index] - floating.robot.stand_pose[index]) < 0.01


def test_velocities_are_the_rates_of_the_poses_in_their_frames(floating: Bench) -> None:
    """Linear in the world, angular in the torso: engines mix these conventions up."""
    state = floating.float()
    step = floating.plant.physics.step
    spin = 0.0
    for count in range(1, 81):
        before = state
        swing(floating, count)
        state = floating.step(push=np.array([20.0, -10.0, 5.0]))
        moved = (state.torso_position - before.torso_position) / step
        assert state.torso_linear_velocity == pytest.approx(moved, abs=0.01)
        turn = rotation_matrix(before.torso_rotation).T @ rotation_matrix(state.torso_rotation)
        rate = pin.log3(turn) / step
        assert state.torso_angular_velocity == pytest.approx(rate, abs=0.02)
        speed = (state.joint_position - before.joint_position) / step
        assert state.joint_velocity == pytest.approx(speed, abs=0.02)
        spin = max(spin, float(np.abs(rate).max()))
    assert spin > 0.5


def test_a_push_acts_on_the_centre_of_the_torso_and_ends(floating: Bench) -> None:
    floating.float()
    force, steps = np.array([0.0, 25.0, 0.0]), 10
    before = floating.com(floating.backend.observe())
    for _ in range(steps):
        state = floating.step(push=force)
    pushed = floating.com(state)
    for _ in range(50):
        state = floating.step()
    speed = (floating.com(state) - pushed) / (50 * floating.plant.physics.step)
    impulse = force * steps * floating.plant.physics.step
    assert speed == pytest.approx(impulse / floating.body.mass, abs=1e-3)
    assert np.linalg.norm(pushed - before) < 0.01


def test_accelerometer_reads_gravity_at_rest_and_nothing_in_free_fall(
    engine: str, robot: RobotDescription, reference: Plant
) -> None:
    exact = dataclasses.replace(reference, sensors=load_plant("ideal").sensors)
    with Simulation(robot, exact, robot_seed=NOMINAL, engine=engine) as simulation:
        for _ in range(100):
            simulation.step(None)
        frame = simulation.sense()
        assert frame is not None
        assert frame.linear_acceleration == pytest.approx([0.0, 0.0, G], abs=0.1)
        assert frame.angular_velocity == pytest.approx(np.zeros(3), abs=0.01)
        simulation._start = dataclasses.replace(simulation._start, torso_position=HIGH)
        simulation.reset()
        for _ in range(10):
            simulation.step(None)
        frame = simulation.sense()
        assert frame is not None
        assert frame.linear_acceleration == pytest.approx(np.zeros(3), abs=0.1)


def test_standing_for_a_second_goes_nowhere(
    engine: str, robot: RobotDescription, reference: Plant
) -> None:
    with Simulation(robot, reference, robot_seed=NOMINAL, engine=engine) as simulation:
        for _ in range(50):
            simulation.step(None)
        before = simulation.truth()
        for _ in range(100):
            simulation.step(None)
        after = simulation.truth()
    assert np.abs(after.torso_position - before.torso_position).max() < 2e-4
    tilt = np.degrees(np.linalg.norm(pin.log3(rotation_matrix(after.torso_quaternion))))
    assert tilt < 0.5
    assert after.torque_saturated == 0
    assert not after.legs_touch


def slide(simulation: Simulation, push: float) -> tuple[float, float, float]:
    """[m] way, [m/s] speed at the end, and tangential over normal force, in half a second."""
    for _ in range(50):
        simulation.step(None)
    simulation.push(np.array([push, 0.0, 0.0]), 0.5)
    start = simulation.truth().soles[0].position[0]
    for _ in range(49):
        simulation.step(None)
    before = simulation.truth().soles[0].position[0]
    simulation.step(None)
    truth, wrenches = simulation.truth(), simulation._state.sole_wrench
    forces = [
        sole.rotation @ wrench[:3] for sole, wrench in zip(truth.soles, wrenches, strict=True)
    ]
    x, y, z = np.sum(forces, axis=0)
    end = truth.soles[0].position[0]
    return end - start, (end - before) / 0.01, math.hypot(x, y) / z


def test_feet_slide_when_the_force_passes_friction_times_weight(
    engine: str, robot: RobotDescription, reference: Plant
) -> None:
    friction = 0.1  # so that the robot slides before it tips over
    plant = changed(reference, contact={"friction": friction})
    with Simulation(robot, plant, robot_seed=NOMINAL, engine=engine) as simulation:
        grip = friction * simulation.body.mass * G
        way, speed, ratio = slide(simulation, 0.8 * grip)
        assert abs(way) < 4e-3
        assert abs(speed) < 5e-4
        assert ratio == pytest.approx(0.8 * friction, rel=0.1)
        simulation.reset()
        way, speed, ratio = slide(simulation, 1.3 * grip)
        assert way > 0.03
        assert ratio == pytest.approx(friction, rel=0.01)


def test_one_motor_turns_both_hips(
    engine: str, robot: RobotDescription, reference: Plant
) -> None:
    (leader, follower), = robot.coupled_joints
    first, second = robot.index(leader), robot.index(follower)
    with Simulation(robot, reference, robot_seed=0, engine=engine) as simulation:
        target = np.array(robot.stand_pose)
        apart, torque = 0.0, 0.0
        for tick in range(150):
            target[first] = -0.4 * min(1.0, tick / 50.0)
            target[second] = 0.3  # nobody listens to this one
            simulation.step(JointTargets(simulation.time, target, 1.0))
            truth = simulation.truth()
            apart = max(apart, abs(truth.joint_position[first] - truth.joint_position[second]))
            torque = max(torque, abs(truth.joint_torque[second]))
        assert apart < math.radians(0.1)
        assert torque == 0.0
        zero = simulation.individual.joint_zero[first]
        assert truth.joint_position[second] - zero == pytest.approx(-0.4, abs=0.02)


@pytest.mark.parametrize("self_collision", [True, False])
def test_legs_meet_only_with_self_collision(
    engine: str, robot: RobotDescription, reference: Plant, self_collision: bool
) -> None:
    plant = changed(weightless(reference), physics={"self_collision": self_collision})
    bench = Bench(engine, robot, plant)
    assert not bench.float().legs_touch
    bench.set("LHipRoll", -0.35)
    bench.set("RHipRoll", 0.35)
    touched = any(bench.step().legs_touch for _ in range(200))
    rolls = bench.backend.observe().joint_position[
        [robot.index("LHipRoll"), robot.index("RHipRoll")]
    ]
    bench.backend.close()
    assert touched == self_collision
    if not self_collision:
        assert rolls == pytest.approx([-0.35, 0.35], abs=0.01)
    else:
        assert abs(rolls[0]) < 0.34


def test_a_frame_comes_late_by_the_delay(
    engine: str, robot: RobotDescription, reference: Plant
) -> None:
    with Simulation(robot, reference, robot_seed=0, engine=engine) as simulation:
        stamps = []
        for _ in range(8):
            simulation.step(None)
            frame = simulation.sense()
            stamps.append(None if frame is None else simulation.time - frame.stamp)
    assert stamps[:3] == [None, None, None]
    assert stamps[3:] == [40_000_000] * 5


def walk_blindly(simulation: Simulation) -> FloatArray:
    """(ticks, n + 7) of a robot that swings its legs and is pushed until it falls."""
    rows = []
    robot = simulation.robot
    for tick in range(80):
        target = np.array(robot.stand_pose)
        for joint, sign in (("LHipRoll", 1.0), ("RHipRoll", 1.0), ("LKneePitch", 2.0)):
            target[robot.index(joint)] += sign * 0.15 * math.sin(0.12 * tick)
        if tick == 30:
            simulation.push(np.array([15.0, 10.0, 0.0]), 0.1)
        simulation.step(JointTargets(simulation.time, target, 1.0))
        truth = simulation.truth()
        rows.append(
            np.concatenate([truth.torso_position, truth.torso_quaternion, truth.joint_position])
        )
    return np.array(rows)


def test_the_same_robot_does_the_same_to_the_last_bit(
    engine: str, robot: RobotDescription, reference: Plant
) -> None:
    with Simulation(robot, reference, robot_seed=2, engine=engine) as simulation:
        first = walk_blindly(simulation)
        simulation.reset()
        again = walk_blindly(simulation)
    with Simulation(robot, reference, robot_seed=2, engine=engine) as simulation:
        fresh = walk_blindly(simulation)
    with Simulation(robot, reference, robot_seed=4, engine=engine) as simulation:
        other = walk_blindly(simulation)
    assert np.array_equal(first, again)
    assert np.array_equal(first, fresh)
    assert not np.array_equal(first, other)


def test_rigid_floor_does_not_give_way(
    engine: str, robot: RobotDescription, reference: Plant
) -> None:
    plant = changed(reference, contact={"rigid": True})
    with Simulation(robot, plant, robot_seed=NOMINAL, engine=engine) as simulation:
        for _ in range(100):
            simulation.step(None)
        truth = simulation.truth()
    assert max(abs(sole.position[2]) for sole in truth.soles) < 3e-4


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("stiffness", 150.0),
        ("armature", 1.0),
        ("friction", 0.3),
        ("play", 0.02),
        ("encoder_feedback", True),
    ],
)
def test_pybullet_refuses_what_it_cannot_honour(
    robot: RobotDescription, reference: Plant, option: str, value: float | bool
) -> None:
    plant = changed(reference, motor={option: value})
    with pytest.raises(NaoGaitError, match=rf"motor\.{option}: got {value}; .*pybullet"):
        Simulation(robot, plant, engine="pybullet")


def test_pybullet_refuses_the_worn_plant(robot: RobotDescription) -> None:
    with pytest.raises(NaoGaitError, match=r"worn: motor\.\w+: got .* with engine pybullet"):
        Simulation(robot, load_plant("worn"), engine="pybullet")


def test_an_unknown_engine_is_refused(robot: RobotDescription, reference: Plant) -> None:
    with pytest.raises(NaoGaitError, match="engine: got 'mojoco'; allowed: pybullet, mujoco"):
        Simulation(robot, reference, engine="mojoco")


def test_an_engine_that_is_missing_says_what_to_install(
    robot: RobotDescription, reference: Plant, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(engines, "installed", lambda engine: engine == "pybullet")
    with pytest.raises(NaoGaitError, match=r"pybullet; or pip install 'mujoco>=4,<5'"):
        Simulation(robot, reference, engine="mujoco")


# MuJoCo alone: the ingredients of the worn plant, one by one.


@pytest.fixture
def mujoco_only() -> None:
    if not engines.installed("mujoco"):
        pytest.skip("mujoco is not installed")


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

    from sim_bridge.mujoco_backend import MujocoBackend

    bench = Bench("mujoco", robot, reference)
    joints = np.random.default_rng(1).uniform(robot.lower, robot.upper)
    bench.backend.reset(StartState(HIGH, TUMBLED, joints))
    backend = bench.backend
    assert isinstance(backend, MujocoBackend)
    mujoco.mj_forward(backend._model, backend._data)
    full = np.zeros((backend._model.nv, backend._model.nv))
    mujoco.mj_fullM(backend._model, backend._data, full)
    own = full[6:, 6:] - np.diag(backend._model.dof_armature[6:])
    model = UrdfModel(robot)
    q = pin.neutral(model.model)
    for joint, angle in zip(model.columns, joints, strict=True):
        q[joint.idx_q] = angle
    expected = pin.crba(model.model, model.data, q)
    expected = np.triu(expected) + np.triu(expected, 1).T
    rows = [joint.idx_v for joint in model.columns]
    assert own == pytest.approx(expected[np.ix_(rows, rows)], abs=1e-9)
    assert full[0, 0] == pytest.approx(model.mass, abs=1e-9)


@pytest.mark.usefixtures("mujoco_only")
def test_a_servo_sags_by_torque_over_stiffness(robot: RobotDescription, reference: Plant) -> None:
    plant = changed(reference, motor={"stiffness": 150.0})
    with Simulation(robot, plant, robot_seed=NOMINAL, engine="mujoco") as simulation:
        for _ in range(200):
            simulation.step(None)
        truth = simulation.truth()
    for joint in ("LKneePitch", "RKneePitch", "LAnklePitch", "LHipRoll"):
        index = robot.index(joint)
        sag = robot.stand_pose[index] - truth.joint_position[index]
        assert sag == pytest.approx(truth.joint_torque[index] / 150.0, abs=1e-5)
    assert abs(truth.joint_torque[robot.index("LKneePitch")]) > 0.3


@pytest.mark.usefixtures("mujoco_only")
def test_play_is_free_and_no_wider(robot: RobotDescription, reference: Plant) -> None:
    """A foot thrown to either side of its play goes that far while its motor stays."""
    from sim_bridge.mujoco_backend import MujocoBackend

    play = 0.04
    bench = mujoco_bench(robot, changed(weightless(reference), motor={"play": play}))
    index = robot.index("LAnklePitch")
    fixed = robot.stand_pose[index]
    backend = bench.backend
    assert isinstance(backend, MujocoBackend)
    hinge = backend._model.joint("LAnklePitch_play").dofadr[0]
    reached: dict[str, float] = {}
    for name, side in (("down", 1.0), ("up", -1.0)):
        bench.float()
        backend._data.qvel[hinge] = side * 0.5
        seen = [bench.step().joint_position[index] - fixed for _ in range(60)]
        reached[name] = side * max(side * angle for angle in seen)
    assert reached["down"] == pytest.approx(play / 2.0, abs=0.1 * play)
    assert reached["up"] == pytest.approx(-play / 2.0, abs=0.1 * play)


@pytest.mark.usefixtures("mujoco_only")
def test_inside_the_play_the_motor_feels_nothing(
    robot: RobotDescription, reference: Plant
) -> None:
    bench = mujoco_bench(robot, changed(weightless(reference), motor={"play": 0.04}))
    index = bench.set("RAnklePitch", robot.stand_pose[robot.index("RAnklePitch")] + 0.01)
    before = bench.backend.observe()
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
    """A knee under load rests at one end of its play; what it carries tells the servo's error."""
    motor = {"stiffness": 150.0, "play": 0.04, "encoder_feedback": encoder_feedback}
    plant = changed(reference, motor=motor)
    knees = [robot.index(joint) for joint in ("LKneePitch", "RKneePitch")]
    with Simulation(robot, plant, robot_seed=NOMINAL, engine="mujoco") as simulation:
        for _ in range(300):
            simulation.step(None)
        truth = simulation.truth()
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
    """With 64 steps per turn no reading says 0.03 rad: the joint goes to where the reading changes
    from too little to too much, half a step from 0."""
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
    with Simulation(
        robot, plant, robot_seed=NOMINAL, engine="mujoco", start_state="lying_back"
    ) as simulation:
        target = np.array(robot.stand_pose)
        for _ in range(20):
            simulation.step(JointTargets(simulation.time, target, 1.0))
        index = robot.index("LAnklePitch")
        before = simulation.truth().joint_position[index]
        for _ in range(60):
            simulation.step(JointTargets(simulation.time, target, 0.0))
        moved = abs(simulation.truth().joint_position[index] - before)
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
        ("motor", "lag", 0.0, r"at least 0\.004 s"),
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
        Simulation(robot, plant, engine="mujoco")


@pytest.mark.usefixtures("mujoco_only")
def test_the_worn_plant_stands(robot: RobotDescription) -> None:
    with Simulation(robot, load_plant("worn"), robot_seed=0, engine="mujoco") as simulation:
        for _ in range(200):
            simulation.step(None)
        truth = simulation.truth()
    tilt = np.degrees(np.linalg.norm(pin.log3(rotation_matrix(truth.torso_quaternion))))
    assert tilt < 3.0
    assert truth.sole_force.min() > 10.0


# The gait on both engines.


def walked(task: str, engine: str, plant: str = "reference") -> float:
    """[m/s] of robot 0 in the asked direction, over 3 s at full command; NaN after a fall."""
    spec = RolloutSpec(TASKS[task].lasting(3.0), robot_seed=0, engine=engine, plant=plant)
    metrics = rollout(spec).metrics
    return math.nan if metrics.fell else math.copysign(1.0, spec.task.asked) * metrics.speed_x


@pytest.mark.usefixtures("mujoco_only")
@pytest.mark.parametrize("task", ["forward", "back"])
def test_the_walk_does_not_live_off_one_engine(task: str) -> None:
    speed = walked(task, "pybullet")
    assert speed > 0.15
    assert walked(task, "mujoco") == pytest.approx(speed, rel=0.1)


@pytest.mark.usefixtures("mujoco_only")
def test_the_walk_bears_the_worn_plant() -> None:
    assert walked("forward", "mujoco", "worn") > 0.2
