"""The loop of the bridge: when physics steps, in real time, as fast as possible or in lockstep."""

import time

from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from nao_lipm_gait.ros.process import StopRequest
from sim_bridge.ros.node import BridgeNode
from sim_bridge.ros.pacing import Pacer

RESEND = 0.25
"""[s] wall time until lockstep sends an unanswered reading again: sensors are best effort."""
COMPLAIN = 3.0
"""[s] wall time until lockstep complains about a missing answer, and again."""


def drive(node: Node, executor: SingleThreadedExecutor, stop: StopRequest) -> None:
    """Step physics when it is due, and serve callbacks in between, until a stop is asked for."""
    if not isinstance(node, BridgeNode):
        raise TypeError(type(node).__name__)
    pacer = Pacer(node.control_period, node.factor)
    lost = 0
    while not stop:
        if not _served(node, executor, stop, pacer):
            return
        node.advance()
        pacer.stepped()
        if pacer.lost > lost:
            lost = pacer.lost
            node.fall_behind(lost * 1e-9)


def _served(
    node: BridgeNode, executor: SingleThreadedExecutor, stop: StopRequest, pacer: Pacer
) -> bool:
    """Serve callbacks until the next step may be taken; False when a stop was asked for."""
    begin = resent = complained = time.monotonic()
    spun = False  # once at least: also a bridge that is late has to listen
    while not stop:
        wait = pacer.wait()
        waits_for_answer = node.lockstep and node.awaited is not None
        if not waits_for_answer:
            if wait <= 0.0 and spun:
                return True
            executor.spin_once(timeout_sec=min(max(wait, 0.0), 0.1))
            spun = True
            continue
        spun = True
        executor.spin_once(timeout_sec=0.05)
        now = time.monotonic()
        if node.awaited is not None and now - resent > RESEND:
            resent = now
            node.resend()
        if node.awaited is not None and now - complained > COMPLAIN:
            complained = now
            node.complain(now - begin)
        if now - begin > RESEND:
            pacer.restart()
    return False
