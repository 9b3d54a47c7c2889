"""A simulated robot in place of a real one.

`world` holds robots and a ball on a floor and steps a physics engine of `engines`; `ros` puts each
robot behind the topics of a real one, `lola` behind the socket of LoLA. Of the gait's package it
uses the robot description, types, geometry, errors, resources and schema, and what every node
needs: message conversion, parameters, log throttling and the process lifecycle. It does not depend
on the gait itself. The field is that of `robot_core.field`.
"""
