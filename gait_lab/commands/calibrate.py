"""`nao_gait calibrate`: measure the constant errors of the running robot's sensors."""

import argparse
import sys
from pathlib import Path

from gait_lab.terminal import EXIT_FAILED, EXIT_OK, say


def run(arguments: argparse.Namespace) -> int:
    """Run the command; return the exit status."""
    from gait_lab.drive import calibrate

    try:
        calibrate.run(arguments.out, namespace=arguments.namespace, say=say)
    except calibrate.CalibrationError as error:
        sys.stderr.write(f"nao_gait calibrate: {error}; nothing was written\n")
        return EXIT_FAILED
    return EXIT_OK


def add(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    parser.add_argument("-o", "--out", type=Path, default=Path("out/calibration.yaml"),
                        metavar="FILE", help="file to write (out/calibration.yaml)")  # fmt: skip
    parser.add_argument("--namespace", default="", metavar="NS", help="namespace of the robot")
    parser.set_defaults(run=run)
