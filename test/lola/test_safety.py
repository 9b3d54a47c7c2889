"""Laws of the bridge's safety: what leaves for the robot, whatever comes in."""

import math
import random
from dataclasses import replace

import numpy as np
import pytest

from lola_bridge.codec import JOINTS, LolaSensors
from lola_bridge.safety import REST, JointCommand, Mode, SafeCommand, Safety
from lola_frames import CONFIG, LOWER, MAP, SAFETY, SIT, SPEED, STAND, UPPER, sensors

GO = JointCommand(STAND, [1.0] * 25)
KNEE = JOINTS.index("LKneePitch")


def run(
    safety: Safety, cycles: int, command: JointCommand | None = GO, **changes: object
) -> list[SafeCommand]:
    """Cycles of a robot that is where it was told to be."""
    sent = []
    for _ in range(cycles):
        position = sent[-1].position if sent else STAND
        frame = sensors(**{"position": position, **changes})
        sent.append(safety.step(frame, command))
    return sent


@pytest.fixture
def active() -> Safety:
    safety = Safety(SAFETY)
    run(safety, 15)
    assert safety.mode is Mode.ACTIVE
    return safety


def test_a_robot_without_commands_is_limp_and_where_it_is():
    sent = run(Safety(SAFETY), 3, None, position=[0.02] * 25)
    assert all(each.mode is Mode.LIMP and max(each.stiffness) == 0.0 for each in sent)
    assert sent[-1].position[KNEE] == 0.02


def test_stiffness_and_pose_rise_from_where_the_robot_is():
    sent = run(Safety(SAFETY), 12, position=SIT)
    stiffness = [each.stiffness[KNEE] for each in sent]
    assert stiffness[0] <= 0.11
    assert stiffness == sorted(stiffness)
    assert stiffness[-1] == 1.0
    assert abs(sent[0].position[KNEE] - SIT[KNEE]) <= SPEED[KNEE] * 0.012 + 1e-9


def test_wrists_and_hands_stay_limp(active: Safety):
    sent = run(active, 1)[0]
    for joint in ("LWristYaw", "RWristYaw", "LHand", "RHand"):
        assert sent.stiffness[JOINTS.index(joint)] == 0.0
    assert sent.stiffness[KNEE] == 1.0


def test_a_missing_command_is_the_last_one_again(active: Safety):
    before = run(active, 1)[0]
    again = run(active, 4, None)
    assert all(each.position == before.position and each.mode is Mode.ACTIVE for each in again)
    assert active.repeated == 4
    assert run(active, 1)[0].mode is Mode.ACTIVE


def test_after_a_silence_it_sits_and_rests_with_less_stiffness_then_goes_limp(active: Safety):
    sent = run(active, 6, None)
    assert sent[-1].mode is Mode.SITTING
    sent = run(active, 130, None)
    assert sent[-1].mode is Mode.RESTING
    assert sent[-1].position == SIT
    assert max(sent[-1].stiffness) == REST
    sent = run(active, round(61.0 / 0.012), None)
    assert sent[-1].mode is Mode.LIMP
    assert max(sent[-1].stiffness) == 0.0


def test_a_new_command_stands_it_up_from_where_it_sits(active: Safety):
    run(active, 200, None)
    sent = run(active, 1)[0]
    assert sent.mode is Mode.STARTING
    assert sent.position[KNEE] == pytest.approx(SIT[KNEE], abs=SPEED[KNEE] * 0.012)
    assert run(active, 15)[-1].mode is Mode.ACTIVE


def test_a_robot_that_lies_does_not_sit_down(active: Safety):
    assert run(active, 7, None, angles=[0.0, 1.4])[-1].mode is Mode.RELAXING
    assert run(active, 12, None, angles=[0.0, 1.4])[-1].mode is Mode.LIMP


def test_a_robot_that_was_limp_is_not_made_stiff_by_a_silence(active: Safety):
    run(active, 2, JointCommand(STAND, [0.0] * 25))
    sent = run(active, 100, None)
    assert max(max(each.stiffness) for each in sent) == 0.0


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"battery": [0.03, 0.0, -1.0, 35.0]}, "battery at 3 %"),
        ({"temperature": [80.0] * 25}, "LHipYawPitch at 80 deg C"),
        ({"robot_config": CONFIG._replace(body_version="5.0.0")}, "body version: got '5.0.0'"),
    ],
)
def test_what_speaks_against_commands_is_said_once_and_makes_it_sit(
    active: Safety, changes: dict, reason: str
):
    active.take_log()
    sent = run(active, 200, **changes)
    assert sent[0].mode is Mode.SITTING
    assert sent[-1].mode is Mode.RESTING
    lines = [line.text for line in active.take_log() if reason in line.text]
    assert len(lines) == 1
    assert run(active, 15)[-1].mode is Mode.ACTIVE


CHEST = [1.0] + [0.0] * 13
HEAD = [0.0, 1.0, 1.0, 1.0] + [0.0] * 10
ELBOW = JOINTS.index("LElbowRoll")
SECOND = round(1.0 / SAFETY.period)


def at(joint: int, value: float, rest: float) -> list[float]:
    """(25,) one value at a joint."""
    return [value if index == joint else rest for index in range(25)]


@pytest.mark.parametrize(
    "changes",
    [{"temperature": at(ELBOW, 80.0, 38.0)}, {"status": [int(v) for v in at(ELBOW, 2, 0)]}],
)
def test_a_hot_arm_goes_limp_alone_and_is_used_again(active: Safety, changes: dict):
    sent = run(active, 5, **changes)[-1]
    assert sent.mode is Mode.ACTIVE
    assert (sent.stiffness[ELBOW], sent.stiffness[KNEE]) == (0.0, 1.0)
    assert any("LElbowRoll at" in line.text for line in active.take_log())
    assert run(active, 2)[-1].stiffness[ELBOW] == 1.0


def test_a_leg_motor_that_says_it_is_very_hot_makes_it_sit(active: Safety):
    status = [int(v) for v in at(KNEE, 2, 0)]
    assert run(active, 1, status=status)[-1].mode is Mode.SITTING


def fault_of_motion(safety: Safety, joint: int, cycles: int) -> list[SafeCommand]:
    """Cycles in which a joint stays where it is while the rest follows."""
    sent = []
    for cycle in range(cycles):
        target = list(STAND)
        target[joint] += 0.4 * np.sin(0.1 * cycle)
        position = list(sent[-1].position) if sent else list(STAND)
        position[joint] = STAND[joint]
        sent.append(safety.step(sensors(position=position), JointCommand(target, [1.0] * 25)))
    return sent


def test_a_leg_encoder_that_sticks_makes_it_limp(active: Safety):
    sent = fault_of_motion(active, KNEE, SECOND + 20)
    assert sent[-1].mode is Mode.LIMP
    assert any("LKneePitch shows one angle" in line.text for line in active.take_log())


def test_an_arm_encoder_that_sticks_makes_the_joint_limp(active: Safety):
    sent = fault_of_motion(active, ELBOW, 2 * SECOND)[-1]
    assert sent.mode is Mode.ACTIVE
    assert (sent.stiffness[ELBOW], sent.stiffness[KNEE]) == (0.0, 1.0)


def test_a_knee_far_from_its_command_is_given_up_within_its_time(active: Safety):
    position = at(KNEE, STAND[KNEE] + 0.6, 0.0)
    position = [p if i == KNEE else STAND[i] for i, p in enumerate(position)]
    sent = run(active, SECOND + 3, position=position)
    assert sent[-1].mode is Mode.RELAXING
    assert any("LKneePitch is 0.60 rad from its command" in line.text for line in active.take_log())
    assert all(each.mode is Mode.ACTIVE for each in sent[: SECOND - 3])


def test_a_short_lag_of_a_joint_is_no_fault(active: Safety):
    position = [p + 0.6 * (i == KNEE) for i, p in enumerate(STAND)]
    for _ in range(5):
        assert run(active, SECOND // 2, position=position)[-1].mode is Mode.ACTIVE
        assert run(active, 1)[-1].mode is Mode.ACTIVE


def test_a_motor_that_draws_too_much_is_given_up(active: Safety):
    sent = run(active, SECOND * 2, current=at(ELBOW, 6.0, 0.1))
    assert sent[-1].stiffness[ELBOW] == 0.0
    assert run(active, SECOND * 2, current=at(KNEE, 6.0, 0.1))[-1].mode in (
        Mode.RELAXING, Mode.LIMP,
    )  # fmt: skip


def test_what_was_given_up_is_used_again_after_a_long_press(active: Safety):
    fault_of_motion(active, KNEE, SECOND + 30)
    assert run(active, 20)[-1].mode is Mode.LIMP, "it does not go on by itself"
    run(active, 2, touch=CHEST)
    run(active, 20)
    run(active, SECOND + 2, touch=CHEST)
    assert run(active, 20)[-1].mode is Mode.ACTIVE


def test_a_long_press_forgets_the_current_that_was_too_much(active: Safety):
    run(active, SECOND * 2, current=at(KNEE, 6.0, 0.1))
    run(active, SECOND, touch=HEAD)
    run(active, 20)
    run(active, SECOND + 2, touch=CHEST)
    assert run(active, 20)[-1].mode is Mode.ACTIVE


def test_a_new_node_or_connection_does_not_use_again_what_was_given_up(active: Safety):
    fault_of_motion(active, KNEE, SECOND + 30)
    active.configure(SAFETY)
    assert run(active, 30)[-1].mode is Mode.LIMP
    active.restart()
    assert run(active, 30)[-1].mode is Mode.LIMP


def test_a_hot_motor_whose_temperature_becomes_unknown_is_not_used(active: Safety):
    assert run(active, 1, temperature=at(KNEE, 85.0, 38.0))[-1].mode is Mode.SITTING
    assert run(active, 200, temperature=at(KNEE, math.nan, 38.0))[-1].mode is Mode.RESTING
    assert run(active, 20)[-1].mode is Mode.ACTIVE
    assert run(active, 1, temperature=at(KNEE, math.nan, 38.0))[-1].mode is Mode.ACTIVE


def press(safety: Safety, rng: random.Random, seconds: float) -> list[SafeCommand]:
    """A press with bounces of 5 to 150 ms at its begin and its end."""

    def cycles() -> int:
        return max(1, round(rng.uniform(0.005, 0.15) / SAFETY.period))

    sent: list[SafeCommand] = []
    for _ in range(rng.randint(1, 4)):
        sent += run(safety, cycles(), touch=CHEST)
        sent += run(safety, cycles())
    sent += run(safety, round(seconds / SAFETY.period), touch=CHEST)
    for _ in range(rng.randint(0, 3)):
        sent += run(safety, cycles())
        sent += run(safety, cycles(), touch=CHEST)
    return sent


@pytest.mark.parametrize("seed", range(20))
def test_the_chest_button_stops_at_once_whatever_it_bounces_and_goes_on_when_held(
    active: Safety, seed: int
):
    rng = random.Random(seed)
    sent = press(active, rng, rng.uniform(0.0, 3.0))
    assert sent[0].mode is Mode.SITTING
    assert all(each.mode in (Mode.SITTING, Mode.RESTING) for each in sent)
    assert run(active, 250)[-1].mode is Mode.RESTING
    assert press(active, rng, 0.1)[-1].mode is Mode.RESTING, "a short press does not go on"
    run(active, 30)
    press(active, rng, 1.5)
    assert run(active, 30)[-1].mode is Mode.ACTIVE


def test_a_robot_that_lies_ignores_its_chest_button(active: Safety):
    lying = {"angles": [0.0, 1.4]}
    assert run(active, 20, touch=CHEST, **lying)[-1].mode is Mode.ACTIVE
    assert run(active, 20)[-1].mode is Mode.ACTIVE
    run(active, 2, touch=CHEST)
    run(active, 20, **lying)
    run(active, 2 * SECOND, touch=CHEST, **lying)
    assert run(active, 20, **lying)[-1].mode is not Mode.ACTIVE, "nobody starts it while it lies"


@pytest.mark.parametrize("ramp", [0.0, 0.12, 3.0])
@pytest.mark.parametrize("before", ["active", "starting", "sitting", "resting", "holding"])
def test_the_head_buttons_take_the_stiffness_off_in_the_same_cycle(ramp: float, before: str):
    holding = before == "holding"
    safety = Safety(replace(SAFETY, stiffness_ramp=ramp, wait_for_button=holding))
    if holding:
        run(safety, 3, None, stiffness=[0.8] * 25)
    else:
        run(safety, 3 if before == "starting" else 10 + round(ramp / SAFETY.period))
        run(safety, {"sitting": 10, "resting": 130}.get(before, 0), None)
    sent = run(safety, 3, touch=HEAD)
    assert all(max(each.stiffness) == 0.0 and each.mode is Mode.LIMP for each in sent)
    assert run(safety, 30)[-1].mode is Mode.LIMP, "it stays so until the chest button is held"


def test_it_can_wait_for_the_chest_button():
    safety = Safety(replace(SAFETY, wait_for_button=True))
    assert run(safety, 20)[-1].mode is Mode.LIMP
    assert run(safety, 5, touch=CHEST)[-1].mode is Mode.LIMP
    run(safety, 20)
    assert run(safety, SECOND + 5, touch=CHEST)[-1].mode is Mode.STARTING


def test_a_stiff_robot_that_waits_for_its_button_holds_its_pose():
    """As after another program that has ended."""
    safety = Safety(replace(SAFETY, wait_for_button=True))
    sent = run(safety, 200, None, stiffness=[0.8] * 25, position=STAND)
    assert all(each.mode is Mode.HOLDING and each.stiffness[KNEE] == 0.8 for each in sent)
    assert sent[-1].position == pytest.approx(STAND)


def test_a_dry_run_sends_no_stiffness():
    safety = Safety(replace(SAFETY, dry_run=True))
    sent = run(safety, 30, position=SIT)
    assert safety.mode is Mode.ACTIVE
    assert all(max(each.stiffness) == 0.0 and each.position == SIT for each in sent)


def test_a_stiff_robot_that_nobody_commands_is_sat_down():
    """As after a driver that was killed: the robot still holds its last command."""
    safety = Safety(SAFETY)
    sent = run(safety, 200, None, stiffness=[0.8] * 25)
    assert sent[0].mode is Mode.SITTING
    assert sent[0].stiffness[KNEE] == 0.8
    assert sent[-1].mode is Mode.RESTING


def test_the_end_of_the_node_sits_it_down_and_makes_it_limp(active: Safety):
    active.release()
    assert run(active, 1)[0].mode is Mode.SITTING
    assert run(active, 200)[-1].mode is Mode.LIMP


def test_lost_sensors_make_it_sit(active: Safety):
    for _ in range(7):
        sent = active.step(None, GO)
    assert sent.mode is Mode.SITTING
    assert run(active, 20)[-1].mode is Mode.ACTIVE


def absurd(rng: random.Random) -> float:
    return rng.choice((rng.uniform(-4, 4), 1e30, -1e30, 0.0, rng.uniform(-1e3, 1e3)))


def random_sensors(rng: random.Random) -> LolaSensors | None:
    if rng.random() < 0.1:
        return None
    return sensors(
        position=[absurd(rng) for _ in range(25)],
        stiffness=[rng.uniform(-1, 2)] * 25,
        temperature=[rng.choice((30.0, 75.0, 90.0, -1e9))] * 25,
        battery=[rng.choice((0.9, 0.01, -5.0)), 0.0, 0.0, 0.0],
        angles=[rng.choice((0.0, 1.5, -9.0)), 0.0],
        touch=[float(rng.random() < 0.1) for _ in range(14)],
    )


@pytest.mark.parametrize("seed", range(4))
def test_nothing_that_comes_in_leads_beyond_a_limit(seed: int):
    rng, safety = random.Random(seed), Safety(replace(SAFETY, sit_time=0.024))
    before: SafeCommand | None = None
    modes = set()
    for _ in range(3000):
        frame = random_sensors(rng) if rng.random() < 0.3 else sensors(position=STAND)
        command = None
        if rng.random() < 0.8:
            command = JointCommand(
                [absurd(rng) for _ in range(25)], [rng.uniform(-2, 2) for _ in range(25)]
            )
        sent = safety.step(frame, command)
        modes.add(sent.mode)
        position, stiffness = np.array(sent.position), np.array(sent.stiffness)
        assert (position >= LOWER).all()
        assert (position <= UPPER).all()
        assert ((stiffness >= 0.0) & (stiffness <= 1.0)).all()
        assert not stiffness[~np.array(MAP.driven)].any()
        if before is not None:
            held = (stiffness > 0.05) & (np.array(before.stiffness) > 0.05)
            change = np.abs(position - before.position)
            assert (change[held] <= np.array(SPEED)[held] * 0.012 + 1e-9).all()
        before = sent
    assert modes >= {Mode.LIMP, Mode.STARTING, Mode.ACTIVE, Mode.SITTING, Mode.RELAXING}
