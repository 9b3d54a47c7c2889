"""`nao_gait`: the tools around the gait, one table. Each command imports only what it needs."""

import argparse
import math
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from gait_lab.bench import command as bench
from gait_lab.command_line import Command, Parser, add_commands, argument
from gait_lab.terminal import EXIT_FAILED, EXIT_INTERRUPTED, EXIT_USAGE, accept_any_locale
from nao_lipm_gait import __version__
from robot_core.errors import NaoGaitError, one_line
from robot_core.ros.executable import import_advice, sourced_ros
from robot_core.schema import Choice, Number, Text
from sim_bridge.trials.compiled import check_fresh

_NAO = "nao_h21_v33"
_WHOLE = Number(whole=True)
_PORT = Number(1, 65535, whole=True)
_TEAM = Text(pattern=r"[\w!-'*-~]{1,40}",
             description="1 to 40 characters without spaces and brackets")  # fmt: skip
_SECONDS = Number(1e-3, 1e9, "s")
_NAMESPACE = argument("--namespace", default="", metavar="NS", help="namespace of the robot")
_STAMPED = argument("--stamped", action="store_true", help="send TwistStamped")
_CHECK = argument("--check", action="store_true", help="only compare; status 1 if a file differs")
_JOBS = argument("--jobs", kind=_WHOLE, metavar="N", help="processes (all cores)")
_ROBOT = argument("--robot", "--urdf", default=_NAO, metavar="NAME", dest="urdf",
                  help=f"shipped robot ({{urdf}}), or a URDF, MJCF or robot file ({_NAO})",
                  )  # fmt: skip
_FAST = argument("--fast", group="pace", action="store_false", dest="real_time", default=False,
                 help="in lockstep, as fast as the machine can (default)")  # fmt: skip
_REAL_TIME = argument("--real-time", group="pace", action="store_true",
                      help="in real time, not in lockstep")  # fmt: skip
_ENGINE = Choice(("mujoco", "pybullet"))
_RENDERS = argument("--engine", default="mujoco", kind=_ENGINE, metavar="E",
                    help="renders a scene: mujoco (default) or pybullet")  # fmt: skip
_MOTION = argument("path", type=Path, metavar="FILE", help="motion file (.yaml)")

_DEMO = (
    argument("--headless", group="window", action="store_false", dest="gui", default=False,
             help="no window (default)"),
    argument("--gui", group="window", action="store_true",
             help="a window with the robot, in real time"),
    _FAST,
    _REAL_TIME,
    argument("--out", writes="folder", default=Path("out/demo"), metavar="DIR",
             help="bag, table and figures (out/demo)"),
    argument("--tour", default="full", metavar="NAME", help="full (default) or short"),
    argument("--robot-seed", kind=Number(-1, 2**31 - 1, whole=True), default=0, metavar="S",
             help="the individual (0); -1 is the nominal robot"),
    _ROBOT,
    argument("--plant", default="reference", metavar="P",
             help="shipped name ({plants}) or YAML file (reference)"),
    argument("--engine", kind=_ENGINE, metavar="E",
             help="physics engine: pybullet (default), or mujoco (default where motors give way)"),
    argument("--preset", default="default", metavar="NAME",
             help="shipped name ({gait}) or YAML file; default is the robot's own"),
)  # fmt: skip
_MATCH = (
    argument("--scene", default="pitch_small", metavar="S",
             help="shipped scene ({scenes}) or YAML file (pitch_small)"),
    argument("--robots", kind=_WHOLE, metavar="N", help="robots in each team (as in the scene)"),
    argument("--minutes", kind=Number(), default=2.0, metavar="M",
             help="simulated minutes of a half (2); with rendered images 2 take about 20 real "
             "minutes on two cores"),
    _FAST,
    _REAL_TIME,
    argument("--vision", kind=Choice(("camera", "model")), default="camera", metavar="V",
             help="camera: rendered images over ROS 2 (default); model: percepts with the errors "
             "that were measured on images, in one process"),
    argument("--composed", action="store_true",
             help="over ROS 2: gait, vision and player of a robot in one process, which takes "
             "less time"),
    argument("--eyes", kind=_WHOLE, metavar="N",
             help="rendered images without ROS 2: one process plays, N further ones render and "
             "see (0: the same one does; 2 use two cores)"),
    argument("--seed", kind=_WHOLE, default=0, metavar="S", help="of the robots and all noise (0)"),
    argument("--engine", default="mujoco", kind=_ENGINE, metavar="E",
             help="physics engine: mujoco (default) or pybullet"),
    argument("--video", action="store_true",
             help="a video file (MP4), too: a picture takes about 0.04 s of processor time"),
    argument("--out", writes="folder", default=Path("out/match"), metavar="DIR",
             help="replay, with --video the video, over ROS 2 logs and bag (out/match)"),
    argument("--policy", action="append", default=[], metavar="NAME=VALUE",
             help="how red plays beside others, without ROS 2 (--vision model or --eyes); names: "
             "nao_gait bench match --help; may be repeated"),
    argument("--against", action="append", default=[], metavar="NAME=VALUE",
             help="the same of blue; may be repeated"),
    argument("--json", writes="file", metavar="FILE", help="the result as JSON"),
)  # fmt: skip
_RCSS = (
    argument("--host", kind=Text(), default="127.0.0.1", metavar="H",
             help="of the server (127.0.0.1)"),
    argument("--port", kind=_PORT, default=60000, metavar="P", help="for players (60000)"),
    argument("--team", kind=_TEAM, default="nao_lipm_gait", metavar="NAME",
             help="of the team (nao_lipm_gait)"),
    argument("--number", group="who", kind=Number(1, 99, whole=True), default=2, metavar="N",
             help="of the player (2); 1 is the goalkeeper"),
    argument("--players", group="who", metavar="A-B", help="several players, such as 1-7"),
    argument("--robot", default="K1", metavar="R", help="of the server: K1 (default) or T1"),
    argument("--drive", metavar="VX,VY,WZ",
             help="walk so fast [m/s, rad/s] instead of playing soccer; 0,0,0: stand"),
    argument("--field", default="fifa7vs7", metavar="F",
             help="of the server: fifa7vs7 (default) or fifa"),
    argument("--exact", action="store_true",
             help="percepts as the server tells them, without errors, misses and delay"),
    argument("--seconds", kind=_SECONDS, default=math.inf, metavar="S",
             help="leave after S simulated seconds"),
    argument("--preset", default="default", metavar="NAME", help="of the gait (the robot's own)"),
)  # fmt: skip
_RECORD = (
    argument("bag", group="bag", writes="folder", nargs="?", metavar="BAG",
             help="a new folder for the bag; the same as --out"),
    argument("-o", "--out", group="bag", writes="folder", default=Path("out/bag"), metavar="DIR",
             help="a new folder for the bag (out/bag)"),
    argument("--topics", nargs="+", default=(), metavar="TOPIC",
             help="only these topics (default: all that appear)"),
    argument("--images", action="store_true",
             help="images, too: they are rendered only for a listener"),
    argument("--duration", kind=_SECONDS, metavar="S", help="seconds of wall time"),
    argument("--storage", kind=Choice(("mcap", "sqlite3")), default="mcap", metavar="S",
             help="mcap (default) or sqlite3"),
)  # fmt: skip
_REPORT = (
    argument("bag", type=Path, metavar="BAG", help="a rosbag2 folder, or an .mcap or .db3 file"),
    argument("after", type=Path, nargs="?", metavar="BAG2",
             help="a second bag to compare the first with"),
    argument("--robot", default="", metavar="NAME", help="one robot of a bag with several"),
    argument("-o", "--out", "--output", writes="file", default=Path("report.html"), dest="out",
             metavar="FILE", help="the page, complete in one file (report.html)"),
)  # fmt: skip
_ESTIMATE = (
    argument("path", type=Path, metavar="LOG", help="an .npz file of sensors, or a bag"),
    argument("--robot", required=True, metavar="FILE", help="shipped robot ({urdf}) or its URDF"),
    argument("--imu", default="", metavar="LINK",
             help="link of the IMU (that of the bag, or the one with imu in its name)"),
    argument("--soles", nargs=2, default=(), metavar=("LEFT", "RIGHT"),
             help="links of the soles (l_sole r_sole, or as `nao_gait robot check` finds them)"),
    argument("--out", writes="folder", default=Path("out/estimate"), metavar="DIR",
             help="figure and arrays (out/estimate)"),
    argument("--json", writes="file", dest="json_file", metavar="FILE", help="the errors as JSON"),
)  # fmt: skip
_VIEW = (
    argument("--port", kind=_PORT, default=8080, metavar="P",
             help="port of the page on 127.0.0.1 (8080, or next free one)"),
    _NAMESPACE,
    _STAMPED,
    argument("--duration", kind=_SECONDS, default=math.inf, metavar="S",
             help="end after S s of wall time"),
)  # fmt: skip
_TUNE = (
    argument("study", metavar="STUDY",
             help="shipped name ({studies}) or YAML file; it names robot, plant and parameters"),
    argument("--robot", "--urdf", metavar="NAME", dest="urdf",
             help="shipped robot ({urdf}), or a URDF, MJCF or robot file (the study's)"),
    argument("--method", metavar="M", help="surrogate, pso, cma, tpe, random (the study's)"),
    argument("--trials", kind=_WHOLE, metavar="N", help="trials (the study's own)"),
    argument("--workers", kind=_WHOLE, metavar="N", help="processes (all cores)"),
    argument("--resume", action="store_true", help="continue the study in --out"),
    argument("--join", action="store_true",
             help="help the tuner that leads this study, from here or another machine: search "
             "only"),
    argument("--storage", kind=Text(), metavar="URL",
             help="database of the trials that several machines share (a file in --out)"),
    argument("--out", writes="folder", metavar="DIR",
             help="trials, preset, report (out/tune/STUDY)"),
    argument("--seed", kind=_WHOLE, default=0, metavar="S", help="seed of the method (0)"),
    argument("--engine", kind=_ENGINE, metavar="E",
             help="physics engine of the search (the study's)"),
    argument("--no-confirm", action="store_false", dest="confirm",
             help="do not confirm the winner on unseen robots"),
    argument("--confirm-on", action="append", default=[], metavar="ENGINE/PLANT", dest="places",
             help="where to confirm it instead of the study's places; may be repeated"),
)  # fmt: skip
_RESULTS = (
    argument("--quick", action="store_true",
             help="few robots, short windows; uncommitted changes are allowed"),
    argument("--only", action="append", default=[], metavar="SECTION",
             help="only this section, e.g. speed; may be repeated"),
    argument("--allow-dirty", action="store_true",
             help="measure although there are uncommitted changes"),
    argument("--mark-stale", action="store_true",
             help="measure nothing; mark the results whose walk has changed"),
    argument("--placo-python", metavar="PATH",
             help="Python of an environment that has placo; without it the section peers is left "
             "out"),
    argument("--docs", writes="folder", metavar="DIR",
             help="folder of results.md and results.csv (docs)"),
    _JOBS,
)  # fmt: skip
_FINGERPRINT = (
    argument("--engine", action="append", kind=_ENGINE, metavar="E",
             help="only this engine, mujoco or pybullet; may be given twice"),
    argument("--compare", type=Path, metavar="FILE",
             help="compare with an earlier output of this command"),
    _JOBS,
)  # fmt: skip
_TEACH = {
    "record": Command("poses of the running robot become a file", "gait_lab.drive.teach:record", (
        argument("path", writes="file", metavar="FILE", help="motion file (.yaml)"),
        _ROBOT, _NAMESPACE,
        argument("--meaning", default="", metavar="TEXT", help="what it is for"),
        argument("--starts", default="standing", metavar="P", help="posture before"),
        argument("--ends", default="standing", metavar="P", help="posture after"),
        argument("--stiff", action="store_true", help="keep the joints stiff"),
        argument("--head", action="store_true", help="include the head"),
    )),
    "play": Command("play a file on the running robot", "gait_lab.drive.teach:play",
                    (_MOTION, _ROBOT, _NAMESPACE)),
    "check": Command("check a file", "gait_lab.drive.teach:check", (_MOTION, _ROBOT)),
    "list": Command("the shipped motions of a robot", "gait_lab.drive.teach:listing", (_ROBOT,)),
}  # fmt: skip
_VISION = {
    "calibrate": Command(
        "a colour table from images; takes the field, the lines, ball and teams by itself",
        "gait_lab.vision.color_images:calibrate", (
            argument("source", metavar="SOURCE",
                     help="a bag with images, a folder of PNG images, or a scene"),
            argument("-o", "--out", writes="file", default=Path("out/colors.yaml"), metavar="FILE",
                     help="table to write, with a picture beside it (out/colors.yaml)"),
            argument("--base", default="pitch", metavar="TABLE",
                     help="names the colours, and gives those that no image shows (pitch)"),
            argument("--topic", default="", metavar="T", help="images of a bag (all)"),
            _RENDERS,
            argument("--sample", nargs=6, action="append", default=[], dest="samples",
                     metavar=("CLASS", "IMAGE", "X0", "Y0", "X1", "Y1"),
                     help="this rectangle of this image (its number in the picture) shows this "
                     "class; may be repeated"),
        ),
    ),
    "sheet": Command(
        "what vision finds in images of both engines, as a picture",
        "gait_lab.vision.contact_sheet:write_sheet",
        (argument("--out", writes="file", required=True, metavar="FILE", help="JPEG to write"),),
    ),
}  # fmt: skip
_WRITE = {
    "parameters": Command("docs/parameters.md", "gait_lab.generated:parameters", (_CHECK,)),
    "tree": Command("docs/behavior.mmd, the tree of options", "gait_lab.generated:tree", (_CHECK,)),
    "urdf": Command("urdf/*.urdf, from the table of facts", "gait_lab.generated:urdf", (
        _CHECK, argument("--folder", type=Path, metavar="DIR", help="where (urdf/)"),
    )),
    "kicks": Command(
        "the kicks of a robot, measured: config/kicks/ROBOT.yaml",
        "gait_lab.soccer.kick_table:write", (
            _ROBOT,
            argument("--robots", kind=Number(1, 1000, whole=True), default=10, metavar="N",
                     help="individuals (10)"),
            argument("--engine", default="mujoco", kind=_ENGINE, metavar="E",
                     help="physics engine (mujoco)"),
            _JOBS,
            argument("--out", writes="file", required=True, metavar="FILE", help="file to write"),
        ),
    ),
    "guide": Command("the figures of docs/tune.md", "gait_lab.tune.guide:write", (
        argument("parameters", nargs="*", metavar="PARAMETER", help="parameters to vary (all)"),
        argument("--out", writes="folder", default=Path("docs/images"), metavar="DIR",
                 help="where (docs/images)"),
    )),
    "examples": Command("a copy of the examples", "gait_lab.generated:examples", (
        argument("--out", type=Path, default=Path("examples"), metavar="DIR",
                 help="a new folder (examples)"),
    )),
    "ros2_control": Command(
        "a robot's URDF with a ros2_control tag, and its controllers",
        "gait_lab.generated:ros2_control", (
            _ROBOT,
            argument("--period", kind=Number(0.002, 0.05, "s"), default=0.01, metavar="S",
                     help="[s] control_period of the gait (0.01)"),
            argument("--out", writes="folder", default=Path("ros2_control"), metavar="DIR",
                     help="where (ros2_control)"),
        ),
    ),
    "gallery": Command("the moving pictures of the README", "gait_lab.report.gallery:write", (
        argument("--out", writes="folder", default=Path("docs/images"), metavar="DIR",
                 help="where (docs/images)"),
    )),
    "picture": Command(
        "a picture of a report; needs the extra browser and a Chromium",
        "gait_lab.report.picture:picture", (
            argument("page", type=Path, metavar="PAGE", help="a page of nao_gait report"),
            argument("out", writes="file", metavar="FILE", help="PNG to write"),
            argument("--section", default="", metavar="S",
                     help="speeds, com, ... (the top of the page)"),
        ),
    ),
}  # fmt: skip

COMMANDS = {
    "demo": Command("watch the robot walk a tour over ROS 2; table, bag and figures",
                    "gait_lab.demo.demo:command", _DEMO),
    "match": Command("two teams play soccer; result and a replay page, over ROS 2 also a bag",
                     "gait_lab.soccer.match_command:play", _MATCH),
    "rcss": Command("walk on RoboCup's simulation server, as one player or several",
                    "gait_lab.rcss.command:run", _RCSS),
    "bench": Command("measure the gait on many robots, in process, without ROS",
                     declare=bench.add),
    "compile": Command("the gait as machine code, for long rollouts; the same walk",
                       "gait_lab.compiled.build:compile_gait",
                       (argument("folder", writes="folder", nargs="?",
                                 default=Path("build/compiled"), metavar="FOLDER",
                                 help="target folder (build/compiled)"),)),
    "fingerprint": Command("hashes of reference rollouts: same hash, same walk",
                           "gait_lab.bench.fingerprint:command", _FINGERPRINT),
    "results": Command("measure what docs/results.md reports, on one commit",
                       "gait_lab.bench.results:command", _RESULTS),
    "tune": Command("search parameters of the gait by a study; a preset comes out",
                    "gait_lab.tune.run:command", _TUNE),
    "record": Command("record topics to a bag (rosbag2; MCAP or sqlite3)",
                      "gait_lab.record.recorder:command", _RECORD),
    "report": Command("a page in one file about a recorded walk, or about two",
                      "gait_lab.report.command:command", _REPORT),
    "estimate": Command("torso, CoM and place over recorded sensors, against a reference",
                        "gait_lab.estimate.command:command", _ESTIMATE),
    "view": Command("watch and drive the running robot in the browser", "gait_lab.view.viewer:run",
                    _VIEW),
    "teach": Command("teach the robot a motion by hand, or play one", parts=_TEACH),
    "teleop": Command("drive the robot from the keyboard", "gait_lab.drive.teleop:run", (
        argument("--velocity", kind=Number(), nargs=3, metavar=("X", "Y", "TURN"),
                 help="without keys: this velocity [m/s, m/s, rad/s] until Ctrl-C"),
        _NAMESPACE, _STAMPED,
        argument("--use-sim-time", action="store_true", help="stamp with /clock"),
    )),
    "robot": Command("robots: what a description says", parts={
        "check": Command("what a URDF or robot file says and lacks, where the robot can stand",
                         "gait_lab.robot_check:check", (
            argument("file", metavar="FILE", help="shipped robot ({urdf}), URDF or robot file"),
            argument("-o", "--out", writes="file", metavar="FILE", help="PNG (out/NAME.png)"),
        )),
    }),
    "calibrate": Command("the running robot measures its soles and its IMU; a file comes out",
                         "gait_lab.drive.calibrate:command", (
        argument("-o", "--out", writes="file", default=Path("out/calibration.yaml"), metavar="FILE",
                 help="file to write (out/calibration.yaml)"),
        argument("--zeros", action="store_true",
                 help="look for a leg joint with a wrong zero, in four poses (75 s)"),
        _NAMESPACE,
    )),
    "vision": Command("the robots' vision: colour tables, what it finds", parts=_VISION),
    "write": Command("files of the repository that are made from its code", parts=_WRITE),
}  # fmt: skip
_EXTRAS = {"cv2": "vision", "imageio_ffmpeg": "video", "mujoco": "mujoco", "playwright": "browser"}
"""Module -> extra that brings it, where that is not the one of the command."""


def build_parser() -> argparse.ArgumentParser:
    """The parser of `nao_gait` with all its commands."""
    parser = Parser(prog="nao_gait", description="Watch, drive and measure walking humanoids.")
    parser.add_argument("--version", action="version", version=f"nao_lipm_gait {__version__}")
    add_commands(parser, COMMANDS)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; the exit status (0 only for success)."""
    words = sys.argv[1:] if arguments is None else list(arguments)
    command = words[0] if words else ""
    accept_any_locale()
    try:
        for word in words:
            if any("\ud800" <= each <= "\udfff" for each in word):  # bytes that are not UTF-8
                raise NaoGaitError("argument", word, "a text in UTF-8")
        # In here, because the options of a suite may need what is not installed.
        parsed = build_parser().parse_args(words)
        if command != "compile":
            check_fresh()
        return int(parsed.run(parsed))
    except NaoGaitError as error:
        sys.stderr.write(f"nao_gait {command}: {error}\n")
        return EXIT_USAGE
    except BrokenPipeError:  # whoever reads the output has ended, as `head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_FAILED
    except OSError as error:  # a full disk, a folder that cannot be written
        refused = NaoGaitError("file or folder", str(error.filename),
                               f"one that can be read and written ({error.strerror})")  # fmt: skip
        text = one_line(error) if error.filename is None else str(refused)
        sys.stderr.write(f"nao_gait {command}: {text}\n")
        return EXIT_FAILED
    except KeyboardInterrupt:
        sys.stderr.write(f"nao_gait {command}: interrupted\n")
        return EXIT_INTERRUPTED
    except ImportError as error:
        if sourced_ros() or not isinstance(error, ModuleNotFoundError):
            sys.stderr.write(f"nao_gait {command}: {import_advice(error)}\n")
            return EXIT_FAILED
        by_command = command if command in ("view", "tune") else "lab"
        extra = _EXTRAS.get(str(error.name), by_command)
        sys.stderr.write(
            f"nao_gait {command}: needs {error.name}, which is not installed; "
            f"in the checkout: pip install '.[{extra}]'; beside an installed ROS: docs/ros.md\n"
        )
        return EXIT_FAILED


if __name__ == "__main__":
    sys.exit(main())
