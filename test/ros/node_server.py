"""Starts nodes as forks of a process that has imported what they use, half of a start.

Each runs as `python -m MODULE` does, with a command line, an environment, an output and an end of
its own. Requests and answers are lines of JSON on stdin and stdout.
"""

import gc
import json
import os
import runpy
import sys
from importlib.util import find_spec
from typing import Any

PRELOADED = (
    "rosidl_generator_py",  # which messages load when they are first used
    "nao_lipm_gait.ros.node",
    "sim_bridge.ros.node",
    "sim_bridge.ros.stepping",
    "nao_soccer.ros.player_node",
    "sim_bridge.engines.pybullet.backend",
    *(("sim_bridge.engines.mujoco.backend",) if find_spec("mujoco") else ()),
)


def serve() -> dict[str, Any] | None:
    """Answer requests until stdin ends; in a fork, return its request."""
    for line in sys.stdin:
        request = json.loads(line)
        if (ended := request.get("ended")) is not None:
            pid, status = os.waitpid(ended, os.WNOHANG)
            answer = os.waitstatus_to_exitcode(status) if pid else None
        else:
            answer = os.fork()
            if answer == 0:
                return dict(request)
        print(json.dumps(answer), flush=True)
    return None


def become(request: dict[str, Any]) -> None:
    """Be the node that is asked for."""
    os.setsid()
    nothing = os.open(os.devnull, os.O_RDONLY)
    log = os.open(request["log"], os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    for old, new in ((nothing, 0), (log, 1), (log, 2)):
        os.dup2(old, new)
    os.environ.clear()
    os.environ.update(request["environment"])
    sys.path[1:1] = filter(None, os.environ.get("PYTHONPATH", "").split(os.pathsep))
    sys.stdout.reconfigure(write_through=True)  # type: ignore[union-attr]
    sys.argv[1:] = request["arguments"]
    runpy.run_module(request["module"], run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    sys.path[0] = os.getcwd()
    for module in PRELOADED:
        __import__(module)
    gc.freeze()  # what is collected is copied
    asked = serve()
    if asked is not None:
        become(asked)
