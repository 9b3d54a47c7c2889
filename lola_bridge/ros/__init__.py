"""The node `lola_bridge`."""
