"""Parameters of the node `sim_bridge`."""

from robot_core.ros.parameters import ROBOT, URDF, node_parameter
from sim_bridge.engines.registry import ENGINES
from sim_bridge.robot import START_STATES
from sim_bridge.scene import FLOOR

SCENE = node_parameter(
    "scene", FLOOR, "floor = one robot on an endless floor; or a shipped scene or a YAML file"
)
ENGINE = node_parameter(
    "engine", "pybullet", "physics engine; default: mujoco for a robot whose motors give way",
    choices=ENGINES,
)  # fmt: skip
PLANT = node_parameter("plant", "reference", "plant: a shipped name or a YAML file")
ROBOT_SEED = node_parameter(
    "robot_seed", 0, "which individual robot; -1 is the nominal one", "", -1, 2**31 - 1
)
SENSOR_DELAY = node_parameter(
    "sensor_delay", 0.04, "age of the sensors when published; default: the plant's", "s", 0.0, 1.0
)
REAL_TIME_FACTOR = node_parameter(
    "real_time_factor", 1.0, "simulated seconds per wall second; 0 = as fast as possible",
    minimum=0.0, maximum=100.0,
)  # fmt: skip
LOCKSTEP = node_parameter(
    "lockstep", False, "physics waits for the joint_command that answers the last joint_states"
)
LOCKSTEP_NODES = node_parameter(
    "lockstep_nodes", "", "names, with commas, that lockstep waits for on /clock/until from the "
    "start; others take part from their first message",
)  # fmt: skip
GUI = node_parameter("gui", False, "open the window of the physics engine")
START_STATE = node_parameter(
    "start_state", "stand", "pose of the robot at the start", choices=START_STATES
)
PUSH_DURATION = node_parameter(
    "push_duration", 0.1, "duration of a push (simulated time)", "s", 0.002, 10.0
)
BALL = node_parameter("ball", False, "a ball on the floor, 0.5 m in front of the start")
PUBLISH_CLOCK = node_parameter(
    "publish_clock", True, "publish /clock; false for all but one of several robots"
)
CAMERAS = node_parameter("cameras", False, "publish images of the robots' cameras")
CAMERA_RATE = node_parameter(
    "camera_rate", 10.0, "images per second of each camera", "Hz", 0.1, 100.0
)
CAMERA_WIDTH = node_parameter("camera_width", 320, "columns of an image", "px", 16, 1920)
CAMERA_HEIGHT = node_parameter("camera_height", 240, "rows of an image", "px", 16, 1440)
CAMERA_DELAY = node_parameter(
    "camera_delay", 0.1, "age of an image when published; default: the plant's", "s", 0.0, 1.0
)
CAMERA_NOISE = node_parameter(
    "camera_noise", 3.0, "standard deviation of a pixel, of 255; default: the plant's", "",
    0.0, 64.0,
)  # fmt: skip
OF_THE_CAMERAS = (CAMERA_RATE, CAMERA_WIDTH, CAMERA_HEIGHT, CAMERA_DELAY, CAMERA_NOISE)
NODE_PARAMETERS = (
    SCENE, URDF, ROBOT, ENGINE, PLANT, ROBOT_SEED, SENSOR_DELAY, REAL_TIME_FACTOR, LOCKSTEP,
    LOCKSTEP_NODES, GUI, START_STATE, PUSH_DURATION, BALL, PUBLISH_CLOCK, CAMERAS, *OF_THE_CAMERAS,
)  # fmt: skip
OF_THE_FLOOR = (URDF, ROBOT, ROBOT_SEED, START_STATE, BALL)
"""Parameters that the other scenes give for each robot."""
