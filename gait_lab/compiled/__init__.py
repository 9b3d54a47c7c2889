"""The gait as machine code: the same source through mypyc, bit for bit the same walk."""

import nao_lipm_gait.gait


def is_compiled() -> bool:
    """Whether this process walks with the compiled gait."""
    return not nao_lipm_gait.gait.__file__.endswith(".py")
