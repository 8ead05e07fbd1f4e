"""Model of an arm that all computations share: bodies, tree, cable routing and cable laws.

A :class:`~cdsm.Manipulator` has one :class:`ArmModel` in ``_model``. Modules that need more than
the public properties of an arm read this model.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm.cable import Cable
from cdsm.cable_chains import Chains
from cdsm.cable_laws import CableLaws, OriginalLength
from cdsm.errors import CableError, UnknownName
from cdsm.geometry import Geometry
from cdsm.kernels import segments
from cdsm.kernels.serpentine_guess import find_blocks
from cdsm.kernels.tree import Indices, Routing, Tree
from cdsm.rigid_body import RigidBody
from cdsm.support.values import Array, frozen
from cdsm.tolerances import Tolerances

_LIMIT_SLACK = 1e-9
"""Angle [rad] beyond a limit that is accepted as rounding, e.g. of a conversion from degrees."""


GRAVITY = (0.0, 0.0, -9.81)
"""Default gravity in base axes [m/s²]."""


class ArmParts(NamedTuple):
    """Everything that defines an arm; two arms are equal if these parts are equal."""

    geometry: Geometry | None
    urdf: str
    cables: tuple[Cable, ...]
    tip: str
    gravity: tuple[float, ...]
    original_length: OriginalLength
    joint_names: tuple[str, ...] | None
    tolerances: Tolerances = Tolerances()


class ArmModel:
    """Arrays and cable laws of an arm that do not depend on the joint angles.

    Attributes:
        body: Rigid-body model.
        tree: Kinematic tree of the joints.
        routing: Cable sites and segments.
        masses: Masses of the links, gravity, and the pose of the tip on its link.
        blocks: Blocks of joints and cables from base to tip. To guess the tensions, the balance of
            one block after the other is solved.
        laws: Elasticities of the cables.
        arrays: All fields of tree, routing and masses in one tuple, as the kernel ``single_pose``
            takes them.
        lowest: Lower joint limits (nv,) [rad], minus the rounding tolerance.
        highest: Upper joint limits (nv,) [rad], plus the rounding tolerance.
    """

    def __init__(
        self, body: RigidBody, cables: tuple[Cable, ...], original_length: OriginalLength
    ) -> None:
        self.body, self.tree, self.masses = body, body.tree(), body.masses()
        self._original_length = original_length
        self._set_cables(cables)
        self.routing = route(body, self.tree, cables)
        self.blocks = find_blocks(self.routing, body.nv)
        self.arrays: tuple[Any, ...] = (*self.tree, *self.routing, *self.masses)
        self.lowest = frozen(body.lower - _LIMIT_SLACK)
        self.highest = frozen(body.upper + _LIMIT_SLACK)

    def _set_cables(self, cables: tuple[Cable, ...]) -> None:
        self._cables, self.laws = cables, CableLaws(cables, self._original_length)

    def with_laws(self, cables: tuple[Cable, ...]) -> ArmModel:
        """Return a model with the laws of ``cables``, whose sites must be those of this model."""
        model = type(self).__new__(type(self))
        same = "body", "tree", "masses", "routing", "blocks", "arrays", "lowest", "highest"
        model.__dict__.update({name: self.__dict__[name] for name in same})
        model._original_length = self._original_length
        model._set_cables(cables)
        return model

    @cached_property
    def chains(self) -> Chains:
        """All cables of the arm, divided at their holes into segments."""
        return Chains.of(self._cables)

    @cached_property
    def segment_laws(self) -> CableLaws:
        """Elasticities of the segments of :attr:`chains`."""
        return CableLaws(self.chains.segments, self._original_length)

    @cached_property
    def chain_arrays(self) -> tuple[Any, ...]:
        """Arguments of the kernel ``single_chains``, which computes the segments between holes."""
        chains, routing = self.chains, route(self.body, self.tree, self.chains.segments)
        span = np.zeros((len(chains.segments), 3), dtype=np.intp)
        moving = routing.segment[:-1, 0]
        span[moving, :2], span[moving, 2] = routing.segment[:-1, 3:], routing.segment[1:, 3]
        return *routing, frozen(span), chains.hole, chains.wrap

    @cached_property
    def moving(self) -> tuple[Indices, Indices, Indices, Indices]:
        """Segments whose length depends on joints, as four arrays (a, b, segment, joint).

        Segment i lies between the sites ``a[i]`` and ``b[i]``. Entry j of ``segment`` and ``joint``
        says that the length of segment number ``segment[j]`` depends on the joint in row
        ``joint[j]`` of :attr:`tree`.
        """
        segment, joint = self.routing.segment, self.routing.joint
        over = np.repeat(np.arange(len(segment) - 1), np.diff(segment[:, 3]))
        return frozen(segment[:-1, 1].copy()), frozen(segment[:-1, 2].copy()), frozen(over), joint

    def beyond_limits(self, q: Array) -> NDArray[np.bool_]:
        """Return for each joint angle of q (nv,) [rad] whether it is beyond its limits (nv,)."""
        return np.asarray((q < self.lowest) | (q > self.highest))


def route(body: RigidBody, tree: Tree, cables: Sequence[Cable]) -> Routing:
    """Return the routing of cables: their sites in joint frames, and their segments.

    Raises CableError for an unknown link, or if two neighbouring sites of a link coincide.
    """
    row, point, fixed = [], [], np.array([cable.lead for cable in cables])
    parts: list[tuple[int, int, int, int, int]] = []
    joints: list[int] = []
    for c, cable in enumerate(cables):
        for i, site in enumerate(cable.sites):
            try:
                joint, rotation, translation = body.locate(site.link)
            except UnknownName as error:
                raise CableError(cable.name, str(error)) from None
            row.append(joint)
            point.append(translation + rotation @ np.array(site.position))
            if i == 0:
                continue
            if row[-2] == row[-1]:  # a segment within one link
                length = math.dist(point[-2], point[-1])
                if length < segments.SHORTEST_SEGMENT:
                    raise CableError(cable.name, f"sites {i} and {i + 1} coincide; leave one out.")
                fixed[c] += length
                continue
            to_a, to_b = joints_to(tree, row[-2]), joints_to(tree, row[-1])
            only_a = [j for j in to_a if j not in to_b]
            only_b = [j for j in to_b if j not in to_a]
            first = len(joints)
            parts.append((c, len(row) - 2, len(row) - 1, first, first + len(only_a)))
            joints += [*only_a, *only_b]
    parts.append((0, 0, 0, len(joints), len(joints)))
    return Routing(
        row=frozen(np.array(row, dtype=np.intp)),
        point=frozen(np.array(point)),
        segment=frozen(np.array(parts, dtype=np.intp)),
        joint=frozen(np.array(joints, dtype=np.intp)),
        fixed=frozen(fixed),
    )


def joints_to(tree: Tree, row: int) -> list[int]:
    """Return the rows in ``tree`` of the joints from the base to the joint in ``row``, included."""
    rows: list[int] = []
    while row:
        rows.insert(0, row)
        row = int(tree.parent[row])
    return rows
