"""What every package stands on: types, geometry, schema, robot, motions, field, node plumbing.

It imports none of the others.
"""
