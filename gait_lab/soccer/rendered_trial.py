"""The world model with rendered images: one robot walks random commands on a field and sees."""

from gait_lab.soccer.ball_course import BallCourse, BallTruth
from gait_lab.soccer.eyes import Sight
from gait_lab.soccer.field_walks import RandomWalk, WalkSpec, half_of, scene_of
from gait_lab.soccer.rendered_eyes import RenderedEyes
from gait_lab.soccer.world_trial import WorldTrace, trace_row
from nao_soccer.vision.settings import settings_of_scene
from nao_soccer.world.looking import Looking
from nao_soccer.world.model import WorldModel
from nao_soccer.world.settings import WorldSettings
from nao_soccer.world.state import HeadMode
from robot_core.types import Pose2
from sim_bridge.cameras.camera import CameraSettings
from sim_bridge.trials.trial import WalkerResponder, make_gaits, make_scene_world, run_responder


def run_rendered(spec: WalkSpec, head: HeadMode = HeadMode.AUTO) -> WorldTrace:
    """Walk, render, see and estimate, all in one loop.

    Raises:
        NaoGaitError: The scene has no field, or its images cannot be rendered.
    """
    scene, settings = scene_of(spec), settings_of_scene(spec.scene)
    with make_scene_world(
        scene, plant=spec.plant, engine=spec.engine, noise_seed=spec.seed, cameras=CameraSettings()
    ) as world:
        robot = world.robot
        (gait,) = make_gaits(world)
        eyes = RenderedEyes(robot, gait, settings)
        model = WorldModel(WorldSettings.on(settings, spec.seed))
        looking = Looking(model.map)
        model.start((robot.truth().base_footprint,))
        half = half_of(scene)
        course = BallCourse((half[0] + 0.2, half[1] + 0.2), spec.seed)
        policy = RandomWalk(half, spec.seed, gait, spec.seconds)
        controller = WalkerResponder(world, robot, gait, policy)
        truths: dict[int, tuple[Pose2, BallTruth]] = {}
        rows = []
        stamp: int | None = None
        for tick in run_responder(world, controller, lambda *_: None, past_falls=True):
            place = tick.truth.base_footprint
            ball = course.at(world.time * 1e-9, place)
            world.put_ball(*ball.position, ball.velocity)
            truths[world.time] = place, ball
            status = tick.status
            if status is None or status.stamp == stamp:
                continue
            stamp = status.stamp
            model.add_odometry(stamp, status.base_footprint_in_odom)
            for percepts in eyes.arrived(Sight(world.time, tick.truth, ball.position)):
                model.add_percepts(percepts)
                state = model.state()
                if state is not None and state.stamp in truths:
                    gait.request_look(looking.goal(head, state))
                    delay = (state.stamp - percepts.stamp) * 1e-9
                    rows.append(trace_row(state, *truths[state.stamp], delay))
            for old in [each for each in truths if each < stamp]:
                del truths[old]
    return WorldTrace.of(rows)
