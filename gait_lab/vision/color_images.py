"""`nao_gait vision calibrate`: a colour table from images of a bag, a folder or a scene."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import yaml

from gait_lab.vision.color_calibration import CalibratedColors, Sample, calibrate_colors
from gait_lab.vision.rendered_frames import HeadSweep, RenderSpec, rendered_frames
from nao_soccer.vision.colors import (
    BALL,
    BLUE,
    CLASSES,
    FIELD,
    NONE,
    RED,
    WHITE,
    YELLOW,
    ColorClassifier,
    ColorTable,
    Image,
    load_color_table,
)
from nao_soccer.vision.controller import ImageInput, pixels_of
from robot_core.errors import NaoGaitError
from robot_core.resources import names
from robot_core.schema import write_text

IMAGES_MAX = 40
"""Number of images that are used, spread evenly over those that there are."""
SHOWN = 6
"""Number of images in the picture."""
SWEEP = HeadSweep(0.6, 0.8, 0.15)
"""What the head of each robot of a scene does."""
SECONDS = 3.0
"""[s] of a scene that each robot sees."""
SCENE_STEP = 6
"""Every so many images of a camera in a scene are used."""
_IMAGE = "sensor_msgs/msg/Image"
_PAINT = {
    NONE: (40, 40, 40), FIELD: (40, 150, 60), WHITE: (255, 255, 255), BALL: (255, 140, 0),
    RED: (220, 30, 40), BLUE: (50, 90, 240), YELLOW: (250, 230, 40),
}  # fmt: skip


def calibrate(
    source: str,
    out: Path,
    *,
    base: str = "pitch",
    topic: str = "",
    engine: str = "mujoco",
    samples: Sequence[Sequence[str]] = (),
    say: Callable[[str], None],
) -> None:
    """Write a colour table, and a picture of how it classifies the images beside it.

    Args:
        source: A bag, a folder of PNG images, or a scene.
        out: The YAML file; the picture has the same name and ends in .png.
        base: Table whose ranges are kept for classes that the images do not show.
        topic: Of the images in a bag; "" for all of them.
        engine: Renders a scene.
        samples: What the user has marked: CLASS IMAGE X0 Y0 X1 Y1 each.
        say: Prints a line.

    Raises:
        NaoGaitError: The source has no images, or they cannot be used.
    """
    if (picture := out.with_suffix(".png")) == out:
        raise NaoGaitError("--out", str(out), "a file of a table, such as colors.yaml")
    marked = [_sample(*words) for words in samples]
    table = load_color_table(base)
    images = _spread(read_images(source, topic=topic, engine=engine))
    found = calibrate_colors(images, table, marked)
    write_text(out, table_yaml(found, f"{len(images)} images of {source}", base), "out")
    shown = picture_of(images, load_color_table(out))
    cv2.imwrite(str(picture), cv2.cvtColor(shown, cv2.COLOR_RGB2BGR))
    say(f"{len(images)} images of {source}")
    for name in CLASSES:
        count = found.pixels[name]
        hue = "-".join(f"{each:g}" for each in getattr(found.table, name).hue)
        kept = f"not in the images; as in {base}"
        say(f"  {name:6s} hue {hue:12s} {f'{count} pixels' if count else kept}")
    say(f"{out}, {picture}")


# -- images ----------------------------------------------------------------------------------------


def _sample(name: str, *numbers: str) -> Sample:
    try:
        image, left, top, right, bottom = (int(number) for number in numbers)
    except ValueError as error:
        allowed = "CLASS and five whole numbers: IMAGE X0 Y0 X1 Y1"
        raise NaoGaitError("sample", " ".join((name, *numbers)), allowed) from error
    return Sample(name, image, (left, top, right, bottom))


def read_images(source: str, *, topic: str = "", engine: str = "mujoco") -> list[Image]:
    """Images (height, width, 3), red, green, blue.

    Args:
        source: A bag, a folder of PNG images, or a scene.
        topic: Of the images in a bag; "" for all of them.
        engine: Renders a scene.

    Raises:
        NaoGaitError: The source has no images.
    """
    path = Path(source)
    if path.is_dir() and any(path.glob("*.png")):
        return _of_folder(path)
    if path.is_dir() or path.suffix in (".mcap", ".db3", ".zstd"):
        return _of_bag(path, topic)
    if path.is_file() or source in names("scenes"):
        return _of_scene(source, engine)
    scenes = ", ".join(names("scenes"))
    raise NaoGaitError("source", source, f"a bag, a folder of PNG images, or a scene ({scenes})")


def _of_folder(folder: Path) -> list[Image]:
    images = []
    for file in sorted(folder.glob("*.png")):
        image = cv2.imread(str(file), cv2.IMREAD_COLOR)
        if image is None:
            raise NaoGaitError(str(file), "unreadable", "a PNG image")
        images.append(np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2RGB), dtype=np.uint8))
    return images


def _of_bag(path: Path, topic: str) -> list[Image]:
    from gait_lab.analysis.bag import open_bag

    topics = [name for name, each in open_bag(path, ()).topics.items() if each.type == _IMAGE]
    allowed = ", ".join(topics) or "a bag with images: nao_gait record --images"
    if not topics or (topic and topic not in topics):
        raise NaoGaitError("topic", topic or f"no {_IMAGE} in {path}", allowed)
    chosen = [topic] if topic else topics
    messages = open_bag(path, chosen).messages
    return [_pixels(name, message) for name in chosen for _, message in messages[name]]


def _pixels(topic: str, message: Any) -> Image:
    given = ImageInput(
        0, message.width, message.height, message.encoding, message.step, bytes(message.data)
    )
    return pixels_of(topic, given)


def _of_scene(scene: str, engine: str) -> list[Image]:
    from sim_bridge.scene import load_scene

    images: list[Image] = []
    around = load_scene(scene)
    for robot in range(len(around.robots)):
        spec = RenderSpec(scene=around, engine=engine, robot=robot, head=SWEEP, seconds=SECONDS)
        frames = [(frame.camera, frame.image) for frame in rendered_frames(spec)]
        for camera in dict(frames):
            images += [image for name, image in frames if name == camera][::SCENE_STEP]
    return images


def _spread(images: list[Image]) -> list[Image]:
    """At most `IMAGES_MAX` of the images, evenly."""
    if len(images) <= IMAGES_MAX:
        return images
    return [images[index * len(images) // IMAGES_MAX] for index in range(IMAGES_MAX)]


# -- results ---------------------------------------------------------------------------------------


def table_yaml(found: CalibratedColors, source: str, base: str) -> str:
    """The table as a file, in the order of its fields."""
    body = yaml.safe_dump(
        found.table.plain(), sort_keys=False, default_flow_style=None, width=100
    )
    kept = ", ".join(name for name, count in found.pixels.items() if not count)
    note = f"; {kept}: not seen, as in {base}" if kept else ""
    return f"# Colour classes by nao_gait vision calibrate, from {source}{note}.\n{body}"


def picture_of(images: Sequence[Image], table: ColorTable) -> Image:
    """Some images with their numbers, each beside its classes."""
    step = max(1, -(-len(images) // SHOWN))
    size = images[0].shape
    rows = []
    for index in range(0, len(images), step):
        image = images[index]
        classifier = ColorClassifier(table)
        classifier.adapt(image, len(image) // 2)
        classes = classifier.classify(classifier.balance(image))
        painted = np.zeros_like(image)
        for number, color in _PAINT.items():
            painted[classes == number] = color
        pair = np.hstack((image, painted))
        pair = np.asarray(cv2.resize(pair, (2 * size[1], size[0])), dtype=np.uint8)
        cv2.putText(pair, str(index), (4, 16), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (255, 0, 255), 1)
        rows.append(pair)
    return np.vstack(rows)
