"""Referee: rules of a match, and the protocol of the GameController."""
