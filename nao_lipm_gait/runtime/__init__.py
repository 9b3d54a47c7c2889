"""Everything between a message and a tick of the gait, without ROS.

`GaitController` takes the contents of messages and returns the joint targets to send. The ROS node,
the fault trials and the benchmarks drive the same class.

    inputs       contents of the messages, and checks of single fields
    controller   GaitController: from a message to its answers
    stamp_monitor, validation, frame_sync
                 the way of a sensor message: is its stamp the next one, are its values plausible,
                 which IMU sample belongs to which joint state
    target_guard the last check of the targets before they are sent
    sensor_outage, commands, motion_requests
                 missing sensors, velocity and head commands, outcomes of requested motions
    diagnostics, reports, state_log, stamp_reports, publisher_watch, tick_times
                 log lines, reports, changes of the state, stamps, publishers that are one too many,
                 durations and late ticks
    latency      warm-up and garbage collection

`sim_bridge` uses `inputs` and `diagnostics` as well: they are shared by both nodes and know neither
the gait nor the robot's stand-in.
"""
