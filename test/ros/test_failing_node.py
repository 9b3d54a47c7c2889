"""A node in which something unexpected happens: one line, a clean end."""

import os
import subprocess
import sys

from robot_core.ros.process import FAILED, DomainClaim
from ros_probe import ROOT, TIMEOUT

FAILING = """
import sys
from rclpy.node import Node
from robot_core.ros.process import StopRequest, run, spin

class Failing(Node):
    def __init__(self):
        super().__init__("failing")
        self.create_timer(0.01, self.fail)
    def fail(self):
        raise ValueError("seven\\nof nine")
    def destroy_node(self):
        print("stopped")
        super().destroy_node()

sys.exit(run("failing", "A node.", [Failing], spin, ["failing", *sys.argv[1:]], StopRequest()))
"""


def run(program: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    with DomainClaim() as domain:
        return subprocess.run(
            [sys.executable, "-c", program, *arguments],
            cwd=ROOT, env=os.environ | domain.environment(), capture_output=True, text=True,
            timeout=TIMEOUT,
        )  # fmt: skip


def test_an_exception_in_a_callback_is_one_line_and_the_node_is_destroyed() -> None:
    ended = run(FAILING)
    assert ended.returncode == FAILED
    assert ended.stderr == "failing: ends after ValueError: seven of nine (<string>:11 in fail)\n"
    assert ended.stdout == "stopped\n"


def test_the_log_tells_at_the_level_debug_where_it_came_from() -> None:
    ended = run(FAILING, "--ros-args", "--log-level", "failing:=debug")
    assert 'in fail\n' in ended.stderr + ended.stdout
    assert "Traceback" in ended.stderr + ended.stdout


FAILING_BESIDE = FAILING.replace("[Failing]", "[Failing, Quiet]").replace(
    "sys.exit(run(",
    """class Quiet(Node):
    def __init__(self):
        super().__init__("quiet")
    def destroy_node(self):
        print("stopped too")
        super().destroy_node()

sys.exit(run(""",
)


def test_a_node_that_fails_ends_those_in_its_process() -> None:
    ended = run(FAILING_BESIDE)
    assert ended.returncode == FAILED
    line = ended.stderr.splitlines()[-1]  # their executor has logged the exception before
    assert line == "failing: ends after ValueError: seven of nine (<string>:11 in fail)"
    assert ended.stdout == "stopped\nstopped too\n"


BROKEN_GAIT = """
import rclpy
from rclpy.executors import SingleThreadedExecutor
from std_srvs.srv import Trigger
from nao_lipm_gait.ros.node import GaitNode
from nao_lipm_gait.runtime.controller import GaitController

def broken(self):
    raise ZeroDivisionError("nine")

GaitController.reports = GaitController.stand = broken
rclpy.init()
node = GaitNode()
executor = SingleThreadedExecutor()
executor.add_node(node)
client = node.create_client(Trigger, "gait/stand")
client.wait_for_service()
answer = client.call_async(Trigger.Request())
while not (answer.done() and node._controller.reporter.rejected["diagnostics"]):
    executor.spin_once()
print(answer.result().success, answer.result().message)
"""


def test_a_gait_outlives_a_report_and_a_service_that_fail() -> None:
    ended = run(BROKEN_GAIT)
    assert ended.stdout == "False ZeroDivisionError: nine (<string>:9 in broken)\n"
    assert "diagnostics: ZeroDivisionError: nine" in ended.stderr
