"""The subcommands of `nao_gait`, one file each: its arguments and the function that runs it."""
