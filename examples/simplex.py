"""The tensegrity simplex, which stands by its prestress: the tension carries most of its stiffness.

In a snake arm the tension itself carries 1 or 2 % of the stiffness, here four fifths. It was built
and measured by Feron, Rhode-Barbarigos and Latteur, *J. Struct. Eng.* 149(7), 2023.
"""

import sys
from pathlib import Path

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


def main(folder: Path) -> None:
    """Print tensions and frequencies beside those of the paper, and draw the simplex."""
    rest = at_rest()
    first, second = cdsm.modes(rest.stiffness).frequencies[:2]
    print("                               cdsm   stated there")
    print(f"force in a strut [N]        {rest.tension[9]:7.0f}           1500")
    print(f"horizontal cable [N]        {rest.tension[0]:7.0f} ")
    print(f"diagonal cable [N]          {rest.tension[6]:7.0f}")
    print(f"lowest mode [Hz]            {first:7.3f}          2.166")
    print(f"the next one [Hz]           {second:7.1f}")
    print(f"active share of the lowest  {100.0 * active_share(rest):6.0f} %")
    cdsm.plots.save_figure(rest.plot(), folder / "simplex.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if sys.argv[1:] else Path(__file__).parent)
