"""`nao_gait vision`: prepare the robots' vision."""

import argparse
from pathlib import Path

from gait_lab.terminal import EXIT_OK, say


def run(arguments: argparse.Namespace) -> int:
    """Make a colour table; the exit status."""
    from gait_lab.vision import color_images
    from gait_lab.vision.color_calibration import Sample
    from robot_core.errors import NaoGaitError

    samples = []
    for name, *numbers in arguments.sample:
        try:
            image, left, top, right, bottom = (int(number) for number in numbers)
        except ValueError as error:
            allowed = "CLASS and five whole numbers: IMAGE X0 Y0 X1 Y1"
            raise NaoGaitError("sample", " ".join((name, *numbers)), allowed) from error
        samples.append(Sample(name, image, (left, top, right, bottom)))
    color_images.calibrate(
        arguments.source,
        arguments.out,
        base=arguments.base,
        topic=arguments.topic,
        engine=arguments.engine,
        samples=samples,
        say=say,
    )
    return EXIT_OK


def add(parser: argparse.ArgumentParser) -> None:
    """Declare the subcommands and their arguments."""
    commands = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    text = "a colour table from images; takes the field, the lines, ball and teams by itself"
    calibrate = commands.add_parser("calibrate", help=text, description=text)
    calibrate.add_argument(
        "source", metavar="SOURCE", help="a bag with images, a folder of PNG images, or a scene"
    )
    calibrate.add_argument("-o", "--out", type=Path, default=Path("out/colors.yaml"),
                           metavar="FILE", help="table to write, with a picture beside it "
                           "(out/colors.yaml)")  # fmt: skip
    calibrate.add_argument("--base", default="pitch", metavar="TABLE",
                           help="names the colours, and gives those that no image shows "
                           "(pitch)")  # fmt: skip
    calibrate.add_argument("--topic", default="", metavar="T", help="images of a bag (all)")
    calibrate.add_argument("--engine", default="mujoco", choices=("mujoco", "pybullet"),
                           help="renders a scene (mujoco)")  # fmt: skip
    calibrate.add_argument("--sample", nargs=6, action="append", default=[],
                           metavar=("CLASS", "IMAGE", "X0", "Y0", "X1", "Y1"),
                           help="this rectangle of this image (its number in the picture) shows "
                           "this class; may be repeated")  # fmt: skip
    calibrate.set_defaults(run=run)
