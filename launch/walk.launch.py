"""Start the gait and the simulated robot: `ros2 launch nao_lipm_gait walk.launch.py rviz:=true`.

With `scene:=pitch` the world has several robots, each with a gait in a namespace of its name; with
`vision:=true` each one that has cameras gets a `vision` too. `walk.launch.py -s` lists arguments.
"""

from launch import LaunchDescription

from gait_lab.launching import describe


def generate_launch_description() -> LaunchDescription:
    """Bridge, gaits, and what the arguments add."""
    return describe(("sim_bridge", "gait", "vision"), {})
