"""Runs in the Python of placo's environment: joint trajectories of placo's walk for a request.

    PLACO_PYTHON -I placo_process.py REQUEST.json ANSWER.npz

It imports nothing of this package, because placo needs another version of Pinocchio. Every
`replan` seconds the footsteps are planned again for the command of that time. placo's pattern
generator plans the CoM and the feet, its kinematics solver the joints. No sensor is used.

Request: `urdf` (text, with the frames trunk, left_foot, right_foot), `joints` (names, in the order
of the answer), `held` (angles of the joints that do not walk), `coupled` (leader, follower pairs),
`foot_ahead` (x of left_foot and right_foot in the soles' own frames [m]), `knots` (time, x, y, yaw:
the command, linear in between), `begin` (of the walk), `end`, `period`, `replan` [s], `walk`
(values in place of the defaults of placo's HumanoidParameters).
Answer: `joints` (n, joints) [rad], `support` (n,) 1 left, -1 right, 0 both, `com` (n, 3) [m] in the
frame of the supporting sole, of the n control periods from 0 to `end`.
"""

import json
import sys
from typing import Any

import numpy as np
import placo

SOLVER_PERIOD = 0.005
"""[s] of the kinematics solver, as in placo's example."""
STEPS_AHEAD = 5
ARMS_WEIGHT = 1.0


def parameters_of(walk: dict[str, float]) -> Any:
    """HumanoidParameters of placo with these values; AttributeError for an unknown name."""
    parameters = placo.HumanoidParameters()
    for name, value in walk.items():
        if not hasattr(parameters, name):
            raise AttributeError(f"placo's HumanoidParameters has no {name}")
        setattr(parameters, name, type(getattr(parameters, name))(value))
    return parameters


class Planner:
    """Robot, solver and trajectory of one request.

    Args:
        request: Request as the module describes it.
    """

    def __init__(self, request: dict[str, Any]):
        self._request = request
        self._knots = np.array(request["knots"], dtype=float)
        self._parameters = parameters = parameters_of(request["walk"])
        self._robot = robot = placo.HumanoidRobot(
            "", placo.Flags.ignore_collisions, request["urdf"]
        )
        self._solver = solver = placo.KinematicsSolver(robot)
        solver.enable_velocity_limits(True)
        solver.dt = SOLVER_PERIOD
        self._tasks = tasks = placo.WalkTasks()
        tasks.initialize_tasks(solver, robot)
        held = solver.add_joints_task()
        held.set_joints(request["held"])
        held.configure("held", "soft", ARMS_WEIGHT)
        if request["coupled"]:
            # One motor less: the torso's yaw is what is left free.
            gears = solver.add_gear_task()
            for leader, follower in request["coupled"]:
                gears.set_gear(follower, leader, 1.0)
            gears.configure("coupled", "hard", 1.0)
            tasks.trunk_orientation_task.mask.set_axises("xy", "local")
        tasks.reach_initial_pose(
            np.eye(4),
            parameters.feet_spacing,
            parameters.walk_com_height,
            parameters.walk_trunk_pitch,
        )

    def command_at(self, time: float) -> np.ndarray:
        """(3,) the command at a time [s]: x, y [m/s], yaw [rad/s]."""
        columns = self._knots.T
        return np.array([np.interp(time, columns[0], column) for column in columns[1:]])

    def _footsteps(self, time: float) -> Any:
        planner = placo.FootstepsPlannerRepetitive(self._parameters)
        step = self.command_at(time) * self._parameters.single_support_duration
        planner.configure(*step.tolist(), STEPS_AHEAD)
        return planner

    def run(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The arrays of the answer: joints, support, CoM."""
        request, robot = self._request, self._robot
        begin, period, replan = request["begin"], request["period"], request["replan"]
        rows, supports, coms = [], [], []
        per_period = round(period / SOLVER_PERIOD)
        count = int(np.ceil(request["end"] / period)) + 1
        resting = min(count, round(begin / period))
        for _ in range(resting):
            rows.append(self._joints())
            supports.append(0)
            coms.append(self._com(1))
        left = placo.flatten_on_floor(robot.get_T_world_left())
        right = placo.flatten_on_floor(robot.get_T_world_right())
        footsteps = self._footsteps(begin).plan(placo.HumanoidRobot_Side.left, left, right)
        generator = placo.WalkPatternGenerator(robot, self._parameters)
        trajectory = generator.plan(
            placo.FootstepsPlanner.make_supports(
                footsteps, 0.0, True, self._parameters.has_double_support(), True
            ),
            robot.com_world(),
            0.0,
        )
        last, side = 0.0, 1
        for tick in range((count - resting) * per_period):
            time = tick * SOLVER_PERIOD
            self._tasks.update_tasks_from_trajectory(trajectory, time)
            robot.update_kinematics()
            self._solver.solve(True)
            both = trajectory.support_is_both(time)
            if not both:
                support = trajectory.support_side(time)
                side = 1 if support == placo.HumanoidRobot_Side.left else -1
                robot.update_support_side(str(support))
                robot.ensure_on_floor()
            if time - last > replan and generator.can_replan_supports(trajectory, time):
                planned = generator.replan_supports(
                    self._footsteps(begin + time), trajectory, time, last
                )
                trajectory = generator.replan(planned, trajectory, time)
                last = time
            if tick % per_period == 0:
                rows.append(self._joints())
                supports.append(0 if both else side)
                coms.append(self._com(side))
        return np.array(rows), np.array(supports), np.array(coms)

    def _joints(self) -> list[float]:
        return [self._robot.get_joint(name) for name in self._request["joints"]]

    def _com(self, side: int) -> np.ndarray:
        """(3,) [m] CoM in the frame of the sole of this foot: 1 left, -1 right."""
        robot, ahead = self._robot, self._request["foot_ahead"]
        foot = robot.get_T_world_left() if side > 0 else robot.get_T_world_right()
        seen: np.ndarray = foot[:3, :3].T @ (robot.com_world() - foot[:3, 3])
        return seen + (ahead, 0.0, 0.0)


def main(arguments: list[str]) -> int:
    """Read the request, write the answer; the exit status."""
    with open(arguments[1], encoding="utf-8") as file:
        request = json.load(file)
    joints, support, com = Planner(request).run()
    np.savez(arguments[2], joints=joints, support=support, com=com)
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv))
