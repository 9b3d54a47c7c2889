"""Everything between a message and a tick of the gait, without ROS.

`GaitController` (`controller`) takes the contents of messages (`inputs`) and returns the joint
targets to send. The ROS node, the fault trials and the benchmarks drive the same class, which
composes:

    intake       messages in, complete sensor frames out, by `stamps`, `validation`, `frame_sync`
    supervisor   what the gait gets in a tick, by `commands` and `watches`
    target_guard the last check of the targets before they are sent
    reporter     what is said, by `diagnostics`, `reports` and `calibration_monitor`

`latency` holds the warm-up and the garbage collection of the node.
"""
