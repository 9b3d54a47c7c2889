"""The subcommands of `nao_gait`, one file each: what may be asked for, and who does it."""
