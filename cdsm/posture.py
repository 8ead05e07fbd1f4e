"""Posture of an arm: everything that depends only on the joint angles."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.cable_path import positions
from cdsm.errors import InvalidInput, listed
from cdsm.geometry.parts import overlapping
from cdsm.pulleys.wrap_table import WrapTable, wrap_table
from cdsm.pulleys.wrapping import Wrapping
from cdsm.routing import Routing, Spans
from cdsm.segments import Segments
from cdsm.support.format import aligned, coordinates, merged, prepare_json
from cdsm.support.result import Result, unit
from cdsm.support.validation import one_of
from cdsm.support.values import Array, ReadOnlyState, draw, frozen

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from cdsm.manipulator import Manipulator


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Posture(ReadOnlyState):
    """Kinematics, cable lengths and gravity of an arm at q; made by :meth:`Manipulator.at`.

    All arrays are read-only and in base axes. Cable lengths include the lead, the straight cable
    between actuator and base disk.

    Attributes:
        arm: The arm.
        q: Joint angles (nv,) [rad].
        tip: Pose of ``tool0`` (4, 4), translation in m (Eqs. 3–4).
        jacobian: `J_X` (6, nv) at ``tool0``: linear rows [m/rad] first, then angular rows.
        cable_lengths: L (C,) [m], lead included (Eq. 8).
        length_jacobian: `J_L = ∂L/∂θ` (C, nv) [m/rad].
        gravity_torque: `g = ∂V/∂θ` (nv,) [N m] with the potential energy V: `J_Hᵀ G_g` of Eq. 13.
        gravity_stiffness: `∂g/∂θ` (nv, nv) [N m/rad]: `H_H G_g` of Eq. 16.
        twist: (v, z) (6, n) of all n joints: a point x that joint j moves has
            `∂x/∂θ_j = v + z × x`.
        placements: Poses (n+1, 4, 4) of the base and of the joints' frames.
        sites: Positions (3, P) [m] of the sites of all cables, and of their contacts with pulleys.
        spans: Segments of all cables, with their motions.
        wrapping: Cables over pulleys; None for an arm without pulleys.

    Example:
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
        >>> pose.length_jacobian.shape, float(pose.cable_lengths[0].round(6))
        ((15, 10), 0.016956)
    """

    arm: Manipulator
    q: Array
    tip: Array
    jacobian: Array
    cable_lengths: Array
    length_jacobian: Array
    gravity_torque: Array
    gravity_stiffness: Array
    twist: Array
    placements: Array
    sites: Array
    spans: Spans
    wrapping: Wrapping | None = None

    def __getstate__(self) -> dict[str, object]:
        """Return all but what follows from the rest, and holds the rigid body: the contacts."""
        return {**super().__getstate__(), "wrapping": None}

    def __setstate__(self, state: dict[str, Any]) -> None:
        if wraps := state["arm"].wraps:
            state = {**state, "wrapping": wraps.at(state["twist"], state["placements"])}
        super().__setstate__(state)

    @property
    def routing(self) -> Routing:
        """Cables as polylines through their sites and their contacts with pulleys."""
        return self.wrapping.pattern.routing if self.wrapping else self.arm.routing

    @cached_property
    def wraps(self) -> WrapTable:
        """Wrap angle, fleet angles and contacts of each cable on each pulley of its path."""
        return wrap_table(self)

    def __repr__(self) -> str:
        return f"<Posture of {self.arm.name}, tip at {coordinates(1e3 * self.tip[:3, 3])} mm>"

    def plot(
        self,
        tension: Result | ArrayLike | None = None,
        stiffness: Result | None = None,
        ax: Axes | None = None,
        **options: Any,
    ) -> Axes:
        """Plot the arm in mm, and return the axes.

        A :class:`~cdsm.Tension` colours its cables. A :class:`~cdsm.Stiffness` adds the compliance
        of the tip. Other options are those of :func:`cdsm.plots.plot_arm`.
        """
        axes: Axes = draw("plot_arm", self, tension, stiffness, ax, **options)
        return axes

    def to_dict(self) -> dict[str, object]:
        """Return angles, tip, cable lengths and moment arms for JSON; keys name the SI units."""
        numbers = {
            "tip_position_m": self.tip[:3, 3],
            "tip_rotation": self.tip[:3, :3],
            "cable_length_m": dict(zip(self.arm.cables.names, self.cable_lengths, strict=True)),
        }
        return merged(prepare_json(numbers), self.moment_arms.to_dict())

    @cached_property
    def moment_arms(self) -> MomentArms:
        """Moment arm of each cable about each joint, found by their names."""
        return MomentArms(posture=self, values=frozen(0.0 - self.length_jacobian))  # no -0.0

    @cached_property
    def length_hessian(self) -> Array:
        """`H_L[c, i, j] = ∂²L_c/∂θ_i∂θ_j` (C, nv, nv) [m/rad²], computed on first use."""
        routing = self.routing
        one = np.ones(routing.cable.size)
        count = len(self.cable_lengths)
        H = routing.hessians(self.spans, one, routing.cable, count)
        if self.wrapping:
            H = H + self.wrapping.shifts.hessians(one, routing.cable, count)
        return frozen(H)

    @cached_property
    def cable_paths(self) -> tuple[Array, ...]:
        """Points along each cable in base axes, one array (n, 3) per cable [m].

        They are its sites, and points on its arcs around pulleys, at most 10° apart.
        """
        if self.wrapping:
            return self.wrapping.paths
        ends = np.cumsum([len(positions(cable.sites)) for cable in self.arm.cables])
        return tuple(frozen(path.copy()) for path in np.split(self.sites.T, ends[:-1]))

    @property
    def joint_positions(self) -> Array:
        """Positions of the joints (nv, 3) [m]: one point on each joint axis."""
        coupling = self.arm.body.coupling
        every = self.placements[1:, :3, 3]
        return frozen(every[list(coupling.leaders)]) if coupling else every

    @property
    def bones(self) -> tuple[Array, ...]:
        """The links as a stick figure: lines (2, 3) [m] from joint to joint and to the tip."""
        return tuple(bone for _, bone in self.bones_by_row)

    @property
    def brackets(self) -> tuple[Array, ...]:
        """Lines (2, 3) [m] from each cable site to the nearest of the bones of the site's link."""
        return tuple(self.stick_figure()[1])

    @cached_property
    def bones_by_row(self) -> list[tuple[int, Array]]:
        """The bones, each with the row of the joint that carries its link; row 0 is the base."""
        origin = self.placements[:, :3, 3]
        body = self.arm.body
        tip = ([0, *body.tip_joints + 1][-1], self.tip[:3, 3])
        ends = [*zip(body.parent[1:], origin[1:], strict=True), tip]
        bones = [(row, np.array([origin[row], end])) for row, end in ends]
        return [(row, frozen(bone)) for row, bone in bones if (bone[0] != bone[1]).any()]

    def stick_figure(self, without: Collection[int] = ()) -> tuple[list[Array], list[Array]]:
        """Return :attr:`bones` and :attr:`brackets`, except those of the rows in ``without``."""
        brackets = []
        for row, site in zip(self.routing.row.tolist(), self.sites.T, strict=True):
            if row not in without:
                feet = [foot(site, bone) for at, bone in self.bones_by_row if at == row]
                ends = feet or [self.placements[row, :3, 3]]
                nearest = min(ends, key=lambda end: float(np.linalg.norm(end - site)))
                brackets.append(frozen(np.array([site, nearest])))
        return [bone for row, bone in self.bones_by_row if row not in without], brackets

    def link_pose(self, link: str) -> Array:
        """Compute the pose (4, 4) [m] of a link's frame in base axes, or raise InvalidInput."""
        poses = self.arm.body.link_placements(self.q)
        return frozen(poses[one_of("link", link, poses)])

    @cached_property
    def self_contacts(self) -> tuple[tuple[str, str], ...]:
        """Pairs of links that overlap, by name, but no neighbours: joint limits keep these apart.

        The body of a link is the cylinder around its disks. Overlaps raise no error. The result is
        empty for a robot from a URDF, since the shapes of its links are unknown.
        """
        if not self.arm.is_serpentine:
            return ()
        disks = self.arm.geometry.disks
        poses = self.arm.body.link_placements(self.q)
        return tuple(overlapping(disks, {disk.link: poses[disk.link] for disk in disks}))

    @property
    def notes(self) -> tuple[str, ...]:
        """What makes `K_θ` doubtful here: cables about to leave their pulleys, springs at rest."""
        return *(self.wrapping.remarks if self.wrapping else ()), *self.arm.springs.doubts(self.q)

    @property
    def remarks(self) -> tuple[str, ...]:
        """What is doubtful here: links that overlap, and :attr:`notes`."""
        pairs = [" and ".join(pair) for pair in self.self_contacts]
        if pairs:
            overlap = f"the arm passes through itself: {listed(pairs, 3, '; ')}"
            return overlap, *self.notes
        return self.notes

    @cached_property
    def segments(self) -> Segments:
        """Lengths of cable segments between holes, and wrap angles; computed on first use."""
        return Segments.at(self.arm.chains, self.twist, self.placements)

    def equals(self, other: Posture) -> bool:
        """Return whether arm and joint angles are equal."""
        return self is other or (self.arm == other.arm and np.array_equal(self.q, other.q))


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class MomentArms(Result):
    """Moment arm of each cable about each joint, `−J_L`: torque per tension `τ = −J_Lᵀ F`, Eq. 13.

    A cable with a positive moment arm turns the joint to positive angles. The moment arm of one
    cable about one joint is ``arms["cable1_1", "joint1_1"]``.

    Attributes:
        posture: The posture.
        values: Moment arms (C, nv) [m]; force per tension [-] for prismatic joints.
    """

    _rows = "cable"

    posture: Posture
    values: Array = field(metadata=unit("m", "cable", "joint", name="moment_arm"))

    def __getitem__(self, names: tuple[str, str]) -> float:
        """Return the moment arm of a cable about a joint."""
        cables = self.posture.arm.cables.names
        joints = self.posture.arm.joint_names
        remedy = f'give a cable and a joint, such as moment_arms["{cables[0]}", "{joints[0]}"].'
        if not isinstance(names, tuple) or len(names) != 2:
            raise InvalidInput("moment_arms", f"{names!r} given; {remedy}")
        row = cables.index(one_of("cable", names[0], cables))
        return float(self.values[row, joints.index(one_of("joint", names[1], joints))])

    def __str__(self) -> str:
        arm = self.posture.arm
        scale = np.where(arm.slides, 1.0, 1e3)
        rows = [
            [cable, *(f"{value:z.2f}" for value in scale * row)]
            for cable, row in zip(arm.cables.names, self.values, strict=True)
        ]
        slide = " [-] where the joint slides;" if arm.slides.any() else ""
        note = f"moment arms [mm],{slide} positive: the cable turns the joint to positive angles"
        return "\n".join([*aligned([["", *arm.joint_names], *rows]), note])


def foot(point: Array, line: Array) -> Array:
    """Return the point (3,) of a line segment ``line`` (2, 3) that is nearest to ``point`` (3,)."""
    span = line[1] - line[0]
    return np.asarray(line[0] + np.clip((point - line[0]) @ span / (span @ span), 0.0, 1.0) * span)
