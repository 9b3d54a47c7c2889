"""Names that a user gave, checked before ROS sees them: its own errors are tracebacks."""

from rclpy.exceptions import NameValidationException
from rclpy.validate_full_topic_name import validate_full_topic_name
from rclpy.validate_namespace import validate_namespace

from nao_lipm_gait.errors import NaoGaitError

_ALLOWED = "letters, digits and _ between /, none of the parts beginning with a digit"


def checked_namespace(name: str) -> str:
    """The namespace, "" for none; NaoGaitError for one that ROS does not have."""
    try:
        validate_namespace(name if name.startswith("/") else f"/{name}")
    except NameValidationException as error:
        raise NaoGaitError("namespace", name, _ALLOWED) from error
    return name


def checked_topics(names: tuple[str, ...]) -> tuple[str, ...]:
    """The topics; NaoGaitError for one that ROS does not have."""
    for name in names:
        try:
            validate_full_topic_name("/" + name.removeprefix("~").removeprefix("/"))
        except NameValidationException as error:
            raise NaoGaitError("topics", name, _ALLOWED) from error
    return names
