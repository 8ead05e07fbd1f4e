"""Arms of rigid links from other sources."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from lxml import etree
from numpy.typing import ArrayLike

from cdsm.cable import Cable
from cdsm.cable_path import Site
from cdsm.manipulator import Manipulator
from cdsm.presets.bodies import JOINT_AXES, SerialBody, chain, moving_joint
from cdsm.presets.prototype import ELASTIC_STAGE
from cdsm.urdf import E, inertial, urdf_text
from cdsm.wires.elasticity import Elasticity
from cdsm.wires.laws import LinearElasticity

_SECTIONS: Final = 12


def sjtu_snake(elasticity: Elasticity = ELASTIC_STAGE) -> Manipulator:
    """Build the snake of Shanghai Jiao Tong University: 12 universal joints, 36 cables.

    Sections of 99.2 mm and 62 g, three cables each on a circle of 19 mm, every section turned by
    10° from the one before. Sources: Tang, Wang, Zheng, Gu, Zhu, Zhu, *Int. J. Adv. Robot. Syst.*
    14(5), 2017, doi 10.1177/1729881417734458, and its model in CASPR (darwinlau/CASPR on GitHub,
    BSD-3-Clause, commit a6971ee), which has the dimensions. **No measurement** of it is used here.
    Assumed: the wire, by default EA = 48 kN (cables of CASPR do not stretch). Left out: products of
    inertia.

    Example:
        >>> import cdsm
        >>> arm = cdsm.presets.sjtu_snake()
        >>> arm.nv, len(arm.cables)
        (24, 36)
    """
    (_, y, z) = JOINT_AXES
    radius, after, before, length = 0.019, 0.01357, 0.09257, 0.09921
    centre, inertia = (0.0477162, 0.0, 0.0), (2.459410464e-5, 8.238686351e-5, 8.257404573e-5)
    at = [(length if k else 0.0, 0.0, 0.0) for k in range(_SECTIONS)]
    kept = (z, y), 0.35, 0.061973305, centre, inertia
    bodies = [SerialBody(f"link{k + 1}", at[k], *kept) for k in range(_SECTIONS)]
    cables = []
    for k in range(1, _SECTIONS + 1):
        for j in range(3):
            angle = math.radians(60 - 10 * k - 120 * j)
            hole = radius * math.sin(angle), radius * math.cos(angle)
            sites = [Site("base", (-after, *hole))]
            for i in range(1, k + 1):
                sites += [Site(f"link{i}", (x, *hole)) for x in (after, before)]
            cables.append(Cable(f"cable{k}_{j + 1}", tuple(sites[:-1]), elasticity))
    urdf = chain("sjtu_snake", bodies, (length, 0.0, 0.0))
    return Manipulator.from_urdf(urdf, cables, tip="tool0")


_NODES: Final = 1e-3 * np.array(
    [
        [0.0, -2043.8, 0.0],
        [0.0, 0.0, 0.0],
        [1770.0, -1021.9, 0.0],
        [590.0, -2201.9, 1950.0],
        [-431.9, -431.9, 1950.0],
        [1611.9, -431.9, 1950.0],
    ]
)  # [m]: three feet, three heads
_STRUTS: Final = {1: 3, 0: 5, 2: 4}  # head of the strut that stands on each foot
_SLIDES: Final = {1: (), 0: ((0, 1, 0),), 2: ((1, 0, 0), (0, 1, 0))}  # of feet on the floor
_HORIZONTAL: Final = (1, 2), (0, 1), (0, 2), (4, 5), (3, 4), (3, 5)
_DIAGONAL: Final = (2, 5), (1, 4), (0, 3)
_FOOT_MASS: Final = 4.70  # of a node [kg]
_HEAD_MASS: Final = 5.13
_TINY: Final = 1e-9  # mass [kg], moment of inertia [kg m²] of links that have none
_HERE: Final = (0.0, 0.0, 0.0)


def simplex() -> Manipulator:
    """Build a measured tensegrity simplex: three struts that touch nowhere, nine cables.

    A strut is a link on a universal joint that can be shortened: inside it a cable, of the last
    three, pulls its head outwards and is as rigid as the strut. So the simplex is an arm of 12
    degrees of freedom. Source: Feron, Rhode-Barbarigos, Latteur, *J. Struct. Eng.* 149(7), 2023,
    with the data of doi 10.14428/DVN/CDLVFV: nodes, rigidities, and masses lumped at the nodes.
    **Stated** there: 1.5 kN in the struts, which are lengthened by 0.717 mm, and a lowest mode of
    2.166 Hz, which is computed. Assumed: moments of inertia of 1e-9 kg m², since nodes are points.
    Nothing is fitted.

    Example:
        >>> import cdsm
        >>> cdsm.presets.simplex().nv
        12
    """
    strut_wire = LinearElasticity(70390e6 * 364.4e-6)
    horizontal_wire = LinearElasticity(71750e6 * 50.3e-6)
    diagonal_wire = LinearElasticity(72190e6 * 50.3e-6)
    parts = [E.link(name="floor")]
    feet = {}
    struts = []
    for foot, head in _STRUTS.items():
        parent, at = "floor", tuple(_NODES[foot])
        for i, direction in enumerate(_SLIDES[foot], start=1):
            mass = _FOOT_MASS if i == len(_SLIDES[foot]) else _TINY
            parts += [
                _link(f"foot{foot}_{i}", mass),
                _joint("prismatic", parent, f"foot{foot}_{i}", at, direction),
            ]
            parent, at = f"foot{foot}_{i}", _HERE
        feet[foot] = Site(parent, at)
        along = _NODES[head] - _NODES[foot]
        first = np.cross(along, [0.0, 0.0, 1.0])
        parts += [
            _link(f"cross{foot}", _TINY),
            _joint("revolute", parent, f"cross{foot}", at, first),
            _link(f"strut{foot}", _TINY),
            _joint("revolute", f"cross{foot}", f"strut{foot}", _HERE, np.cross(along, first)),
            _link(f"head{head}", _HEAD_MASS),
            _joint("prismatic", f"strut{foot}", f"head{head}", along, along),
        ]
        # from the end of the strut to the inner end of its head: it pulls the head outwards
        inside = Site(f"strut{foot}", tuple(along)), Site(f"head{head}", tuple(-along))
        struts.append(Cable(f"strut{foot}{head}", inside, strut_wire))
    places = feet | {head: Site(f"head{head}", _HERE) for head in _STRUTS.values()}
    cables = [
        Cable(f"cable{a}{b}", (places[a], places[b]), wire)
        for pairs, wire in ((_HORIZONTAL, horizontal_wire), (_DIAGONAL, diagonal_wire))
        for a, b in pairs
    ]
    urdf = urdf_text("simplex", parts)
    return Manipulator.from_urdf(urdf, [*cables, *struts], tip="head3", check_inertia=False)


def _link(name: str, mass: float) -> etree._Element:
    return E.link(inertial(mass, _TINY * np.eye(3)), name=name)


def _joint(kind: str, parent: str, child: str, at: ArrayLike, axis: ArrayLike) -> etree._Element:
    along = np.asarray(axis, dtype=float)
    along = along / math.hypot(*along)  # the norm of numpy has other last digits on other machines
    where = np.asarray(at).tolist()
    return moving_joint(kind, f"{child}_joint", parent, child, at=where, axis=along.tolist())
