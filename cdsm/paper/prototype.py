"""The prototype of Section V: the paper prints no dimension of it, so all are assumed or fitted."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from cdsm.cable import serpentine_cables
from cdsm.geometry import Geometry, Link
from cdsm.manipulator import Manipulator
from cdsm.presets import STRAND_1X19
from cdsm.wires.elasticity import Elasticity
from cdsm.wires.laws import LinearElasticity


def experimental_prototype_geometry(
    *, link_mass: float = 0.3, tool_length: float | None = None, **sizes: float
) -> Geometry:
    """Build the geometry of Section V: three hinges of ±30°, each with two antagonistic cables.

    Each hinge is turned about the arm's axis by 30° from the one before. The paper gives no
    dimensions: all are assumed. Raises GeometryError, which lists every fault.

    Args:
        link_mass: Mass of every link [kg].
        tool_length: Distance from the last joint to the weights [m]; None: as long as a link.
        sizes: Other keywords of :meth:`cdsm.Geometry.hinged`: ``link_length`` (0.1 m),
            ``base_length`` (0.05 m), ``disk_offset`` (0.02 m), ``hole_radius`` (0.03 m), ``lead``
            (0.3 m) or ``friction`` (0; the paper has none).

    Example:
        >>> import cdsm
        >>> cdsm.paper.experimental_prototype_geometry().hole_radius
        0.03
    """
    assumed = {"link_length": 0.1, "base_length": 0.05, "disk_offset": 0.02, "hole_radius": 0.03}
    dimensions: dict[str, Any] = assumed | {"lead": 0.3, "joint_limit": np.deg2rad(30.0)} | sizes
    name = "experimental_prototype"
    twist = np.deg2rad(30.0)
    geometry = Geometry.hinged(name=name, joints=3, twist=twist, link_mass=link_mass, **dimensions)
    if tool_length is None:
        return geometry
    last = Link(length=tool_length, mass=link_mass)
    return replace(geometry, links=(*geometry.links[:-1], last))


def experimental_prototype(
    elasticity: Elasticity = STRAND_1X19,
    *,
    series_stiffness: float = math.inf,
    gravity: ArrayLike = (0.0, 0.0, -9.81),
    **dimensions: float,
) -> Manipulator:
    """Build the paper's prototype (Section V-A): pairs of a position- and a force-controlled cable.

    The motor of the first cable of each pair (``cable1_1`` …) keeps its length constant. The motor
    of the second (``cable1_2`` …) keeps its tension constant and adds no passive stiffness. Give
    this tension to :func:`~cdsm.distribute_tension` as ``fixed``.

    Args:
        elasticity: Elasticity of all cables; default as for
            :func:`virtual_prototype <cdsm.presets.virtual_prototype>`.
        series_stiffness: Stiffness of the springs of hybrid cables (Fig. 11), or of the drives
            [N/m].
        gravity: Gravity in base axes (3,) [m/s²]; the direction −z is assumed.
        dimensions: Keywords of :func:`experimental_prototype_geometry`; all have assumed defaults.

    Example:
        >>> import cdsm
        >>> [cable.control for cable in cdsm.paper.experimental_prototype().cables[:2]]
        ['position', 'force']
    """
    geometry = experimental_prototype_geometry(**dimensions)
    first, second = (
        serpentine_cables(geometry, elasticity, series_stiffness=series_stiffness, control=control)
        for control in ("position", "force")
    )
    pairs = [cable for pair in zip(first[::2], second[1::2], strict=True) for cable in pair]
    return Manipulator(geometry, cables=pairs, gravity=gravity)


def fitted_prototype(hybrid_stiffness: float | None = None) -> Manipulator:
    """Build :func:`experimental_prototype` with dimensions fitted to the numbers of Section V.

    The paper prints 20 numbers of its prototype, and no dimension. These dimensions, and the
    conditions of the tests (Section V), are the least-squares fit to the 20 numbers within
    plausible bounds, with x and y exchanged in rows 2 to 4 of Table II. Hole radius and mass of a
    link ended at their largest allowed values, as did the tool and the stiffness of the drives; the
    links at their shortest. Table II is still missed by 21 %, 15 % and 33 % (root mean square in x,
    y and z). So this arm is one possible guess, not the paper's prototype.

    ``hybrid_stiffness`` is that of every cable [N/m], where a spring replaces the elasticity of the
    strand (Figs. 12 and 13). None: the strand, with a drive of 10 kN/mm behind it. Raises
    InvalidInput if it is not a positive number.

    Example:
        >>> import cdsm
        >>> cdsm.paper.fitted_prototype().geometry.hole_radius
        0.05
    """
    strand = hybrid_stiffness is None
    return experimental_prototype(
        STRAND_1X19
        if strand
        else LinearElasticity(1e9).scaled(1e3),  # the spring is all that stretches
        series_stiffness=1e7 if hybrid_stiffness is None else hybrid_stiffness,
        link_length=0.03,
        tool_length=0.3,
        hole_radius=0.05,
        disk_offset=0.0134,  # disks touch at ±30°, the joint limit
        lead=0.08904,
        link_mass=1.0,
    )
