"""Springs in the parameters of MuJoCo's constraints."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Spring:
    """A spring and a damper that hold a constraint.

    Attributes:
        stiffness: [N/m] or [N m/rad].
        damping: [N s/m] or [N m s/rad].
    """

    stiffness: float
    damping: float

    def compiled(self, inverse_inertia: float, step: float) -> tuple[list[float], list[float]]:
        """(solref, solimp) with which MuJoCo integrates this spring implicitly over a step.

        MuJoCo solves R f + a = a_ref with a_ref = -b v - k d r, R = A (1 - d)/d and A the inverse
        inertia seen by the constraint [1/kg] or [1/(kg m^2)]; negative solref numbers are divided
        by d^2 and by d. An implicit spring is f = -(K r + (K dt + B) (v + a dt)).
        """
        slope = self.stiffness * step + self.damping
        regularizer = 1.0 / (step * slope)
        share = inverse_inertia / (inverse_inertia + regularizer)
        solref = [-self.stiffness * regularizer * share, -slope * regularizer * share]
        return solref, [share, share, 0.001, 0.5, 2.0]


RIGID_FLOOR = Spring(1e6, 2e3)
"""Of a contact point: a standing NAO sinks by 6 um."""
END_STOP = Spring(1e4, 5.0)
"""Of joints and of their play."""
COUPLING = Spring(2e4, 20.0)
"""Of joints that share a motor."""
DRY_FRICTION = Spring(0.0, 50.0)
"""Of a joint's dry friction: the joint creeps at torque / damping, below 0.4 deg/s."""
