"""The health of the gait as a message, once a second."""

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from nao_lipm_gait.ros.messages import to_time
from nao_lipm_gait.runtime.diagnostics import Health, Report, reports


def diagnostics(node: str, hardware: str, health: Health) -> DiagnosticArray:
    """One status each for the sensors, the walk and the commands."""
    array = DiagnosticArray()
    if health.status is not None:
        array.header.stamp = to_time(health.status.stamp)
    array.status = [_status(node, hardware, report) for report in reports(health)]
    return array


def _status(node: str, hardware: str, report: Report) -> DiagnosticStatus:
    return DiagnosticStatus(
        level=bytes((report.level,)),
        name=f"{node}: {report.name}",
        message=report.message,
        hardware_id=hardware,
        values=[KeyValue(key=key, value=value) for key, value in report.values.items()],
    )
