"""Motors that give way: torques by virtual work, a robot on soft servos that walks."""

import numpy as np
import pinocchio as pin
import pytest
import yaml

from nao_lipm_gait.gait import Gait
from nao_lipm_gait.walks.base import BodyTargets, SoleTarget
from nao_lipm_gait.whole_body.body_model import BodyModel
from nao_lipm_gait.whole_body.feed_forward import FeedForward
from nao_lipm_gait.whole_body.support_torque import Load, SupportTorque
from robot_core.errors import NaoGaitError
from robot_core.resources import find
from robot_core.robot import RobotDescription, load_robot
from robot_core.types import VelocityCommand
from sim_bridge.simulation import Simulation

GAINS = {  # the manufacturer's for standing
    "Hip_Pitch": (350.0, 7.5), "Hip_Roll": (350.0, 7.5), "Hip_Yaw": (180.0, 3.0),
    "Knee_Pitch": (350.0, 5.5), "Ankle_Pitch": (450.0, 0.5), "Ankle_Roll": (450.0, 0.5),
}  # fmt: skip


@pytest.fixture(scope="module")
def soft(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The robot file of a T1 whose legs give way."""
    values = yaml.safe_load(find("robots", "booster_t1").read_text())
    values["motors"] = [
        {**entry, "joints": [joint], **gains_of(joint)}
        for entry in values["motors"] for joint in entry["joints"]
    ]  # fmt: skip
    values["urdf"] = str(find("urdf", "booster_t1"))
    path = tmp_path_factory.mktemp("soft") / "soft.yaml"
    path.write_text(yaml.safe_dump(values))
    return str(path)


def gains_of(joint: str) -> dict[str, float]:
    found = GAINS.get(joint.split("_", 1)[-1])
    return {} if found is None else dict(zip(("stiffness", "damping"), found, strict=True))


def energy(robot: RobotDescription, body: BodyModel, pose: np.ndarray, weight: float) -> float:
    """Potential energy [J] over the left sole, which stays flat on the ground."""
    com, sole = np.array(body.set_joints(pose)), body.sole_in_torso(1)
    return weight * float(np.dot(com - np.array(sole.position), sole.normal))


@pytest.mark.parametrize("name", ["booster_t1", "op3", "nao_h21_v33"])
def test_the_torques_are_those_of_virtual_work(name: str) -> None:
    robot = load_robot(name)
    torques, body = SupportTorque(robot), BodyModel(robot)
    pose = np.array(robot.stand_pose)
    x, y, _ = np.array(body.set_joints(pose)) - np.array(body.sole_in_torso(1).position)
    found = torques.at(pose, 0.0, (Load(1.0, x, y), Load(0.0)))
    step = 1e-5
    for joint in range(len(pose)):
        plus, minus = pose.copy(), pose.copy()
        plus[joint] += step
        minus[joint] -= step
        work = energy(robot, body, plus, torques.weight) - energy(
            robot, body, minus, torques.weight
        )
        assert found[joint] == pytest.approx(work / (2.0 * step), abs=2e-3)


def test_the_torques_move_the_links_as_asked() -> None:
    """Forward dynamics with the torques and the ground's force give the accelerations back."""
    robot = load_robot("booster_t1")
    torques, body = SupportTorque(robot), BodyModel(robot)
    pose = np.array(robot.stand_pose)
    x, y, _ = np.array(body.set_joints(pose)) - np.array(body.sole_in_torso(1).position)
    wanted = np.random.default_rng(0).uniform(-0.5, 0.5, len(pose))
    load = Load(1.0, 0.02, 0.01, ahead=(x - 0.02) / 0.56, aside=(y - 0.01) / 0.56)
    torque = torques.at(pose, 0.0, (load, Load(0.0)), wanted) - torques._rotor * wanted

    model, data, q = torques._model, torques._data, torques._q
    soles = [torques._sole(frame) for frame in torques._soles]
    _, (shift_x, shift_y, twist) = torques._moving(wanted, (load, Load(0.0)), soles)
    up = torques.weight
    force = np.array((load.ahead * up, load.aside * up, up))
    point = soles[0][0] + (load.x + shift_x, load.y + shift_y, 0.0)
    ankle = model.frames[torques._soles[0]].parentJoint
    forces = [pin.Force.Zero() for _ in range(model.njoints)]
    ground = pin.Force(force, np.cross(point, force) + (0.0, 0.0, twist))  # about the torso
    forces[ankle] = data.oMi[ankle].actInv(ground)
    whole = np.zeros(model.nv)
    whole[torques._v_columns] = torque
    found = pin.aba(model, data, q, np.zeros(model.nv), whole, forces)
    assert found[torques._v_columns] == pytest.approx(wanted, abs=1e-6)
    assert abs(found[3:5]).max() < 1e-6  # it neither pitches nor rolls
    pin.ccrba(model, data, q, found)
    assert data.hg.linear * 9.81 / up == pytest.approx(force * 9.81 / up - (0, 0, 9.81), abs=1e-6)


def test_the_movement_of_the_targets_is_known_in_time() -> None:
    """Torques that come late swing a soft leg past its target."""
    robot, dt, rate = load_robot("booster_t1"), 0.01, 10.0
    forward = FeedForward(robot)
    angle = rate * dt * np.arange(100)
    moves = [forward._moves(np.full(len(robot.joint_names), np.sin(a)), dt) for a in angle]
    velocity, acceleration = (np.array([each[k][0] for each in moves[50:]]) for k in (0, 1))
    waves = np.stack((np.sin(angle[50:]), np.cos(angle[50:])), axis=1)
    late, along = np.linalg.lstsq(waves, velocity, rcond=None)[0]
    assert np.arctan2(late, along) / rate < dt
    along, late = np.linalg.lstsq(waves, acceleration, rcond=None)[0]
    assert np.arctan2(late, -along) / rate < 1.5 * dt
    assert np.hypot(late, along) == pytest.approx(rate**2, rel=0.03)


def test_after_a_motion_the_torques_rise_from_none() -> None:
    """A stand after a get-up begins in another pose than the last one; no kick may come of it."""
    robot, dt = load_robot("booster_k1"), 0.01
    forward, stand = FeedForward(robot), np.array(robot.stand_pose)
    origin = (0.0, 0.0)
    left, right = SoleTarget(0.0, 0.05, 0.0, 0.0), SoleTarget(0.0, -0.05, 0.0, 0.0)
    body = BodyTargets((0.0, 0.0, 0.25), left, right, 0.0, (0.0, 0.0, 0.0))

    def lead(pose: np.ndarray) -> np.ndarray:
        return forward.lead(pose, body, 0, origin, dt)

    lead(stand + 0.5)
    forward.begin()
    leads = np.array([lead(stand) for _ in range(60)])
    assert np.abs(leads[-1]).max() > 0.01
    assert np.abs(np.diff(leads, axis=0, prepend=0.0)).max() < 0.05 * np.abs(leads[-1]).max()


def test_a_lean_loads_the_ankle_by_the_weight_times_its_distance() -> None:
    robot, dt = load_robot("booster_t1"), 0.01
    stand = np.array(robot.stand_pose)
    left, right = SoleTarget(0.0, 0.05, 0.0, 0.0), SoleTarget(0.0, -0.05, 0.0, 0.0)
    body = BodyTargets((0.0, 0.05, 0.25), left, right, 0.0, (0.0, 0.0, 0.0))

    def leads(ahead: float) -> np.ndarray:
        forward = FeedForward(robot)
        origin = (0.0, 0.05)
        return np.array([forward.lead(stand, body, 1, origin, dt, ahead) for _ in range(200)])

    change = leads(0.01) - leads(0.0)
    ankle = robot.left_leg.ankle_pitch
    stiffness = robot.motors[ankle].stiffness or 0.0
    torque = stiffness * change[-1, robot.index(ankle)]
    weight = SupportTorque(robot).weight
    assert torque == pytest.approx(weight * 0.01 * robot.size, rel=0.15)
    assert np.abs(np.diff(change, axis=0, prepend=0.0)).max() < 0.05 * np.abs(change).max()
    right_ankle = robot.index(robot.right_leg.ankle_pitch)
    assert abs(change[-1, right_ankle]) < 0.1 * abs(change[-1, robot.index(ankle)])


def test_only_a_robot_with_soft_motors_gets_a_lead() -> None:
    assert not Gait("nao_h21_v33")._feed_forward.needed
    assert Gait("booster_t1")._feed_forward.needed


def walked(name: str, seconds: float, *, feed_forward: bool) -> tuple[float, float]:
    """Largest sag of a knee [rad] after 2.9 s of standing, and way [m] at 0.15 m/s until a fall."""
    gait = Gait(name)
    robot = gait.robot
    gait._feed_forward.needed &= feed_forward
    knees = [robot.index(leg.knee_pitch) for leg in (robot.left_leg, robot.right_leg)]
    sag = 0.0
    with Simulation(name, engine="mujoco", seed=-1) as sim:
        obs, targets = sim.reset(), None
        for tick in range(round(100 * seconds)):
            obs = sim.step(targets)
            if obs.frame:
                speed = 0.15 * min(max((0.01 * tick - 3.0) / 2.0, 0.0), 1.0)
                targets = gait.step(obs.frame, VelocityCommand(speed))
            if tick == 290:
                sag = float(np.abs(obs.truth.joint_position - gait._sent)[knees].max())
            if gait.state == "fallen":
                return sag, 0.0
        return sag, float(obs.truth.base_footprint[0])


def test_a_robot_on_soft_motors_neither_sags_nor_falls(soft: str) -> None:
    sag, way = walked(soft, 8.0, feed_forward=True)
    assert sag < 0.015
    assert way > 0.4
    sag, _ = walked(soft, 3.0, feed_forward=False)
    assert sag > 0.04


def test_pybullet_refuses_soft_motors(soft: str) -> None:
    with pytest.raises(NaoGaitError, match=r"allowed: mujoco, since .* gives way"):
        Simulation(soft, engine="pybullet")
