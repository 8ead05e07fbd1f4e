"""A tensegrity simplex as a cable-driven arm: three struts that touch nowhere, nine cables.

In a snake arm the tension itself carries 1 or 2 % of the stiffness. Here it carries four fifths, so
this structure tests the active stiffness as no snake arm does. It was built and measured by Feron,
Rhode-Barbarigos and Latteur, *J. Struct. Eng.* 149(7), 2023 (data: doi 10.14428/DVN/CDLVFV).

Nothing is fitted: geometry, rigidities and masses are theirs, and so is the lengthening of the
struts by 0.717 mm, which tightens the cables. A strut is a link on a universal joint that can be
shortened: inside it a cable pulls its head outwards and is as rigid as the strut.

    python examples/tensegrity_simplex.py
"""

from __future__ import annotations

import math

import numpy as np

import cdsm
from cdsm.statics import Equilibrium

NODES = 1e-3 * np.array(
    [
        [0.0, -2043.8, 0.0],
        [0.0, 0.0, 0.0],
        [1770.0, -1021.9, 0.0],
        [590.0, -2201.9, 1950.0],
        [-431.9, -431.9, 1950.0],
        [1611.9, -431.9, 1950.0],
    ]
)
"""Positions of the six nodes [m]: three feet, three heads."""

STRUTS = {1: 3, 0: 5, 2: 4}
"""Head of the strut that stands on each foot."""

SLIDES = {1: (), 0: ((0, 1, 0),), 2: ((1, 0, 0), (0, 1, 0))}
"""Directions in which each foot slides on the floor."""

HORIZONTAL = ((1, 2), (0, 1), (0, 2), (4, 5), (3, 4), (3, 5))
DIAGONAL = ((2, 5), (1, 4), (0, 3))

STRUT = cdsm.LinearElasticity(70390e6 * 364.4e-6)
HORIZONTAL_WIRE = cdsm.LinearElasticity(71750e6 * 50.3e-6)
DIAGONAL_WIRE = cdsm.LinearElasticity(72190e6 * 50.3e-6)

FOOT_MASS, HEAD_MASS = 4.70, 5.13
"""Lumped masses of the nodes [kg]."""

LENGTHENING = 0.717e-3
"""Length by which each strut is made longer than the distance of its nodes [m]."""

_TINY = 1e-9
"""Mass [kg] and moment of inertia [kg m²] of links that have none: simulators need some."""

_HERE = (0.0, 0.0, 0.0)


def simplex() -> cdsm.Manipulator:
    """Build the simplex: 12 degrees of freedom, 9 cables, and 3 that stand for the struts."""
    parts, feet, struts = ['<link name="floor"/>'], {}, []
    for foot, head in STRUTS.items():
        parent, at = "floor", tuple(NODES[foot])
        for i, direction in enumerate(SLIDES[foot], start=1):
            mass = FOOT_MASS if i == len(SLIDES[foot]) else _TINY
            parts += [
                _link(f"foot{foot}_{i}", mass),
                _joint("prismatic", parent, f"foot{foot}_{i}", at, direction),
            ]
            parent, at = f"foot{foot}_{i}", _HERE
        feet[foot] = cdsm.Site(parent, at)
        along = NODES[head] - NODES[foot]
        first = np.cross(along, [0.0, 0.0, 1.0])
        parts += [
            _link(f"cross{foot}", _TINY),
            _joint("revolute", parent, f"cross{foot}", at, first),
            _link(f"strut{foot}", _TINY),
            _joint("revolute", f"cross{foot}", f"strut{foot}", _HERE, np.cross(along, first)),
            _link(f"head{head}", HEAD_MASS),
            _joint("prismatic", f"strut{foot}", f"head{head}", along, along),
        ]
        # from the end of the strut to the inner end of its head: it pulls the head outwards
        inside = (
            cdsm.Site(f"strut{foot}", tuple(along)),
            cdsm.Site(f"head{head}", tuple(-along)),
        )
        struts.append(cdsm.Cable(f"strut{foot}{head}", inside, STRUT))
    places = feet | {head: cdsm.Site(f"head{head}", _HERE) for head in STRUTS.values()}
    cables = [
        cdsm.Cable(f"cable{a}{b}", (places[a], places[b]), wire)
        for pairs, wire in ((HORIZONTAL, HORIZONTAL_WIRE), (DIAGONAL, DIAGONAL_WIRE))
        for a, b in pairs
    ]
    urdf = f'<robot name="simplex">{"".join(parts)}</robot>'
    return cdsm.Manipulator.from_urdf(urdf, [*cables, *struts], tip="head3", check_inertia=False)


def at_rest() -> Equilibrium:
    """Lengthen the struts, all cables just straight, and let the simplex come to rest."""
    pose = simplex().at(np.zeros(12))
    lengths = pose.cable_lengths[9:]
    pushing = STRUT.rigidity(0.0) * LENGTHENING / (lengths - LENGTHENING)
    return cdsm.equilibrium(pose, np.concatenate([np.zeros(9), pushing]))


def active_share(rest: Equilibrium) -> float:
    """Compute the part of the stiffness of the lowest mode that is active (geometric)."""
    K, shape = rest.stiffness, cdsm.modes(rest.stiffness).shapes[:, 0]
    active = shape @ (K.active + K.gravity) @ shape
    return float(active / (shape @ K.joint @ shape))


def _link(name: str, mass: float) -> str:
    inertia = " ".join(f'i{a}="{_TINY}"' for a in ("xx", "yy", "zz"))
    inertia += ' ixy="0" ixz="0" iyz="0"'
    inertial = f'<inertial><mass value="{mass}"/><inertia {inertia}/></inertial>'
    return f'<link name="{name}">{inertial}</link>'


def _joint(kind: str, parent: str, child: str, at: object, axis: object) -> str:
    xyz, unit = np.asarray(at), np.asarray(axis, dtype=float)
    unit = unit / math.hypot(*unit)  # the norm of numpy has other last digits on other machines
    origin, along = (" ".join(map(repr, v.tolist())) for v in (xyz, unit))
    return (
        f'<joint name="{child}_joint" type="{kind}">'
        f'<parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{origin}"/><axis xyz="{along}"/>'
        '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
    )


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
