"""Everything between a message and a tick of the gait, without ROS.

`GaitController` takes the contents of messages and returns the joint targets to send. The ROS node,
the fault trials and the benchmarks drive the same class.

    inputs       contents of the messages, and checks of single fields
    controller   GaitController: from a message to its answers
    stamp_monitor, validation, frame_sync
                 the way of a sensor message: is its stamp the next one, are its values plausible,
                 which IMU sample belongs to which joint state
    target_guard the last check of the targets before they are sent
    sensor_age, sensor_outage, sole_loads, lift_watch, heat_watch
                 late sensors, missing sensors, loads on the soles, a lifted robot, hot motors
    commands, velocity_gate, bias_wait, motion_commands, motion_requests
                 velocity and head commands, when they may move the robot, requested motions
    calibration_monitor
                 what the gait has learned of its sensors
    diagnostics, reports, state_log, stamp_reports, publisher_watch, tick_times
                 log lines, reports, changes of the state, stamps, publishers that are one too many,
                 durations and late ticks
    latency      warm-up and garbage collection

`sim_bridge` uses `inputs`, `diagnostics`, `reports` and `command_input` (the robot's side of
`joint_command`) as well: they know neither the gait nor the simulation.
"""
