"""Start a match: `ros2 launch nao_lipm_gait match.launch.py scene:=pitch_small`.

Bridge and referee, and for each robot of the scene a gait, a vision and a player. In lockstep by
default, as fast as the machine can; `lockstep:=false real_time_factor:=1.0` for real time.
"""

from launch import LaunchDescription

from gait_lab.launching import describe


def generate_launch_description() -> LaunchDescription:
    """All nodes of a match."""
    return describe(
        ("sim_bridge", "gait", "vision", "player", "referee"),
        {
            "scene": "pitch_small",
            "engine": "mujoco",
            "lockstep": "true",
            "real_time_factor": "0.0",
            "bias_wait": "5.0",
        },
    )
