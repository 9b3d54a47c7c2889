"""Nothing runs what comes in, and nothing listens beyond this machine unless told to."""

import ast
import os
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from gait_lab.view import viewer as view
from robot_core.ros.process import RANGE, stay_local
from sros_policy import POLICY, rights

ROOT = Path(__file__).resolve().parents[2]
SOURCES = sorted(
    path for folder in ("nao_lipm_gait", "sim_bridge", "gait_lab", "launch")
    for path in (ROOT / folder).rglob("*.py")
)  # fmt: skip
FORBIDDEN_CALLS = {
    "eval", "exec", "compile", "os.system", "os.popen", "pickle.load", "pickle.loads",
    "marshal.loads", "shelve.open", "yaml.load", "yaml.load_all", "yaml.full_load",
    "yaml.unsafe_load", "subprocess.getoutput", "subprocess.getstatusoutput",
}  # fmt: skip
PROCESSES = {"run", "Popen", "call", "check_call", "check_output"}


def dotted(node: ast.expr) -> str:
    """`a.b` of an expression, empty for what is no name."""
    if isinstance(node, ast.Name):
        return node.id
    if isinstance(node, ast.Attribute):
        inner = dotted(node.value)
        return f"{inner}.{node.attr}" if inner else ""
    return ""


def breaches(source: str) -> list[str]:
    """Calls in a source that run code or commands from outside."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.Call):
            continue
        name = dotted(node.func)
        if name in FORBIDDEN_CALLS:
            found.append(f"{node.lineno}: {name}")
        if any(word.arg == "shell" for word in node.keywords):
            found.append(f"{node.lineno}: shell=")
        starts = name.startswith("subprocess.") and name.split(".")[-1] in PROCESSES
        if starts and node.args and isinstance(node.args[0], ast.JoinedStr | ast.Constant):
            found.append(f"{node.lineno}: a command as one text")
    return found


def test_no_source_runs_what_comes_in() -> None:
    assert len(SOURCES) > 100
    found = {
        str(path.relative_to(ROOT)): lines
        for path in SOURCES if (lines := breaches(path.read_text(encoding="utf-8")))
    }  # fmt: skip
    assert not found


@pytest.mark.parametrize(
    "source",
    ["yaml.load(text)", "os.system('x')", "eval(x)", "subprocess.run(f'ls {x}')",
     "subprocess.Popen(['x'], shell=True)", "pickle.loads(x)"],
)  # fmt: skip
def test_the_search_finds_what_it_looks_for(source: str) -> None:
    assert breaches(source)


def test_the_live_view_listens_on_this_machine_only() -> None:
    assert view.HOST == "127.0.0.1"
    tree = ast.parse(Path(view.__file__).read_text(encoding="utf-8"))
    servers = [
        node for node in ast.walk(tree)
        if isinstance(node, ast.Call) and dotted(node.func) == "viser.ViserServer"
    ]  # fmt: skip
    assert servers
    for server in servers:
        (host,) = (word.value for word in server.keywords if word.arg == "host")
        assert isinstance(host, ast.Name)
        assert host.id == "HOST"


def test_nothing_in_the_package_listens_anywhere_else() -> None:
    for path in SOURCES:
        text = path.read_text(encoding="utf-8")
        assert "0.0.0.0" not in text, path


def test_nodes_and_tools_stay_on_this_machine_unless_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(RANGE, raising=False)
    stay_local()
    assert os.environ[RANGE] == "LOCALHOST"
    monkeypatch.setenv(RANGE, "SUBNET")
    stay_local()
    assert os.environ[RANGE] == "SUBNET", "the setting of the user is kept"


def test_everything_that_joins_ros_limits_discovery_before() -> None:
    for path in SOURCES:
        text = path.read_text(encoding="utf-8")
        if "rclpy.init(" in text:
            before = text[: text.index("rclpy.init(")]
            # A claimed domain is limited to this machine as well.
            assert "stay_local()" in before or "DomainClaim()" in text, path
    launching = (ROOT / "gait_lab" / "launching.py").read_text(encoding="utf-8")
    assert 'EnvironmentVariable(RANGE, default_value="LOCALHOST")' in launching


# -- the SROS2 policy ------------------------------------------------------------------------------


def test_the_policy_is_one_enclave_for_each_process() -> None:
    root = ET.parse(POLICY).getroot()
    assert root.tag == "policy"
    assert root.get("version") == "0.2.0"
    paths = [enclave.get("path") for enclave in root.iter("enclave")]
    assert len(set(paths)) == len(paths) == len(list(root.iter("profile")))


def test_one_node_may_command_the_joints_and_few_may_drive() -> None:
    root = ET.parse(POLICY).getroot()
    nodes = [str(profile.get("node")) for profile in root.iter("profile")]
    may = {node: rights(node).get(("topic", "publish"), set()) for node in nodes}
    assert [node for node in nodes if "joint_command" in may[node]] == ["gait"]
    assert {node for node in nodes if "cmd_vel" in may[node]} == {
        "nao_gait_calibrate", "nao_gait_teleop", "nao_gait_view", "player",
    }  # fmt: skip
    assert not [node for node in nodes if "*" in may[node]]
    subscribed = rights("gait")["topic", "subscribe"]
    truths = {name for name in subscribed if name.startswith("ground_truth")}
    assert not truths, "ground truth never reaches the gait"
