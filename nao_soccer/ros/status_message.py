"""What a node is doing, as one status with its values."""

from collections.abc import Mapping

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from robot_core.ros.messages import to_time


def status_message(
    stamp: int, name: str, text: str, values: Mapping[str, object], *, warns: bool = False
) -> DiagnosticArray:
    """A status at `stamp` [ns]: one line of text, and values by name."""
    array = DiagnosticArray()
    array.header.stamp = to_time(stamp)
    array.status = [
        DiagnosticStatus(
            level=DiagnosticStatus.WARN if warns else DiagnosticStatus.OK,
            name=name,
            message=text,
            values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
        )
    ]
    return array
