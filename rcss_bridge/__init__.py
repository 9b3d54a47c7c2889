"""A player of RoboCup's MuJoCo server (`rcsssmj`) instead of a simulated robot of ours.

`sexpr` and `codec` are the protocol as pure functions, `joints` the names and gains of the server's
robots, `client` the connection, `body` turns a player's percepts into sensor frames and joint
targets into actions. The package needs no simulator: the server runs somewhere else.
"""
