"""The tensegrity simplex, which stands by its prestress: the tension carries most of its stiffness.

In a snake arm the tension itself carries 1 or 2 % of the stiffness, here four fifths. It was built
and measured by Feron, Rhode-Barbarigos and Latteur, *J. Struct. Eng.* 149(7), 2023.

    python examples/simplex.py [FOLDER]
"""

import numpy as np

import cdsm
from cdsm.statics import Equilibrium

LENGTHENING = 0.717e-3
"""Length by which each strut is made longer than the distance of its nodes [m]."""


def at_rest() -> Equilibrium:
    """Lengthen the struts, all cables just straight, and let the simplex come to rest."""
    arm = cdsm.presets.simplex()
    pose = arm.at(np.zeros(12))
    lengths = pose.cable_lengths[9:]
    rigidity = arm.cables[9].elasticity.rigidity(0.0)
    pushing = rigidity * LENGTHENING / (lengths - LENGTHENING)
    return cdsm.equilibrium(pose, np.concatenate([np.zeros(9), pushing]))


def active_share(rest: Equilibrium) -> float:
    """Compute the part of the stiffness of the lowest mode that is active (geometric)."""
    K, shape = rest.stiffness, cdsm.modes(rest.stiffness).shapes[:, 0]
    active = shape @ (K.active + K.gravity) @ shape
    return float(active / (shape @ K.joint @ shape))


def main() -> None:
    """Print tensions and frequencies beside those of the paper."""
    rest = at_rest()
    horizontal, diagonal, strut = rest.tension[0], rest.tension[6], rest.tension[9]
    print(f"strut {-strut:.0f} N, horizontal cable {horizontal:.0f} N, diagonal {diagonal:.0f} N")
    first, second = cdsm.modes(rest.stiffness).frequencies[:2]
    print(f"lowest mode {first:.3f} Hz (computed there: 2.166 Hz), the next {second:.1f} Hz")
    print(f"{100.0 * active_share(rest):.0f} % of the stiffness of the lowest mode is active")


if __name__ == "__main__":
    main()
