"""The nodes `vision`, `player` and `referee`: message conversion, parameters and UDP sockets."""
