"""`nao_gait write gallery`: the moving pictures of the README, walked and played anew."""

from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import numpy as np

from gait_lab.analysis.render import Camera, Image, Renderer, write_gif
from nao_lipm_gait import Gait, Velocity
from robot_core.errors import NaoGaitError
from robot_core.robot.camera import CameraView, Intrinsics, looking
from sim_bridge.individual import NOMINAL, draw_individual
from sim_bridge.plant import load_plant
from sim_bridge.simulation import Simulation

ROBOTS = (
    ("nao_h21_v33", "NAO", 0.35, 0.57),
    ("booster_k1", "Booster K1", 0.35, 0.95),
    ("booster_t1", "Booster T1", 0.25, 1.18),
    ("op3", "ROBOTIS OP3", 0.12, 0.51),
)
"""Robot, its name in the picture, forward speed [m/s], height [m]."""
STAND, SPEED_UP, LENGTH, PERIOD = 1.5, 6.0, 4.0, 0.1
"""[s] of standing; until a robot walks steadily; of a picture; between two of its frames."""
PANEL = 190, 250
"""Width and height of one robot's picture [pixels]."""
KICK_OFF, PLAYED = 23.0, 16.0
"""[s] of the match before the first kick, and in the picture (twice as fast)."""
FIELD_VIEW = Intrinsics.from_fov(600, 280, 0.9)
COLOURS = 48


def write(out: Path, say: Callable[[str], None]) -> None:
    """Write `robots.gif` and `match.gif` into the folder."""
    if not out.is_dir():
        raise NaoGaitError("--out", str(out), "a folder that exists")
    panels = [list(_walk(*each)) for each in ROBOTS]
    write_gif(
        out / "robots.gif", [np.hstack(each) for each in zip(*panels, strict=True)], PERIOD, COLOURS
    )
    say(f"written: {out / 'robots.gif'}")
    write_gif(out / "match.gif", list(_match()), PERIOD, COLOURS)
    say(f"written: {out / 'match.gif'}")


def _walk(urdf: str, name: str, speed: float, height: float) -> Iterator[Image]:
    """Pictures of a robot that walks straight ahead, with its name."""
    import PIL.Image
    import PIL.ImageDraw

    gait = Gait(urdf)
    individual = draw_individual(load_plant("ideal"), gait.robot, NOMINAL)
    every, begin = round(PERIOD / 0.01), round(SPEED_UP / 0.01)
    with Simulation(urdf) as sim, closing(Renderer(gait.robot, individual)) as renderer:
        obs, targets = sim.reset(), None
        camera = Camera(1.75 * height, yaw=38.0, pitch=-12.0, height=0.47 * height)
        for tick in range(begin + round(LENGTH / 0.01)):
            obs = sim.step(targets)
            if obs.frame:
                targets = gait.step(obs.frame, Velocity(speed if tick > 100 * STAND else 0.0))
            if obs.fallen:
                raise NaoGaitError("robot", urdf, "one that stays on its feet")
            if tick == begin:
                origin = obs.truth.torso_position * (1.0, 1.0, 0.0)
            if tick >= begin and (tick - begin) % every == 0:
                position = obs.truth.torso_position - origin
                pose = position, obs.truth.torso_quaternion, obs.truth.joint_position
                picture = PIL.Image.fromarray(
                    renderer.photograph(*pose, position[:2], *PANEL, camera)
                )
                PIL.ImageDraw.Draw(picture).text((8, 6), name, fill="black")
                yield np.asarray(picture)


def _match() -> Iterator[Image]:
    """Pictures of a match of two against two, from beside the field."""
    from gait_lab.soccer.match import Match, MatchSpec

    view = CameraView(FIELD_VIEW, looking(np.array((0.0, -3.3, 1.5)), np.array((0.0, 0.0, 0.1))))
    every = round(2.0 * PERIOD / 0.01)
    first, last = (round(each / 0.01) for each in (KICK_OFF, KICK_OFF + PLAYED))
    with Match(MatchSpec(seed=0, minutes=1.0, frames=False), visual=True) as match:
        for count, _ in enumerate(match.run()):
            if count >= last:
                return
            if count >= first and (count - first) % every == 0:
                yield match.pitch.world.render(view)
