"""Posture of an arm: everything that depends only on the joint angles."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, final

import numpy as np
from numpy.typing import NDArray

import cdsm
from cdsm.cable import Cable
from cdsm.cable_chains import Segments
from cdsm.errors import InvalidInput, listed
from cdsm.geometry.contacts import overlapping
from cdsm.kernels import chains as chain_kernels
from cdsm.kernels import stiffness as stiffness_kernels
from cdsm.kernels.tree import Frames, Routing
from cdsm.support.format import JointUnits, aligned, coordinates, plain, plural
from cdsm.support.tidy import data_frame
from cdsm.support.validation import one_of
from cdsm.support.values import Array, ReadOnlyState, frozen

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

    from cdsm.manipulator import Manipulator
    from cdsm.stiffness_matrix import Stiffness
    from cdsm.tension import Tension


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
        jacobian: J_X (6, nv) at ``tool0``: linear rows [m/rad] first, then angular rows.
        cable_lengths: L (C,) [m], lead included (Eq. 8).
        length_jacobian: J_L = ∂L/∂θ (C, nv) [m/rad].
        gravity_torque: g = ∂V/∂θ (nv,) [N m] with the potential energy V: J_Hᵀ G_g of Eq. 13.
        gravity_stiffness: ∂g/∂θ (nv, nv) [N m/rad]: H_H G_g of Eq. 16.
    """

    arm: Manipulator
    q: Array
    tip: Array
    jacobian: Array
    cable_lengths: Array
    length_jacobian: Array
    gravity_torque: Array
    gravity_stiffness: Array
    _frames: Frames

    def __repr__(self) -> str:
        return f"<Posture of {self.arm.name}, tip at {coordinates(1e3 * self.tip[:3, 3])} mm>"

    def plot(self, tension: Tension | None = None, stiffness: Stiffness | None = None) -> Figure:
        """Plot the arm in mm; ``tension`` colours its cables, ``stiffness`` adds tip compliance.

        Arguments and errors are those of :func:`cdsm.plots.plot_arm`.
        """
        return cdsm.plots.plot_arm(self, tension, stiffness)

    def to_dict(self) -> dict[str, object]:
        """Return angles, tip, cable lengths and moment arms for JSON; keys name the SI units."""
        lengths = dict(zip(self.arm.cables.names, self.cable_lengths, strict=True))
        numbers = {
            **self._coordinates,
            "tip_position_m": self.tip[:3, 3],
            "tip_rotation": self.tip[:3, :3],
            "cable_length_m": lengths,
            **self.moment_arms.to_dict(),
        }
        return plain(numbers)

    @property
    def _coordinates(self) -> dict[str, object]:
        return JointUnits(self.arm.slides).to_dict(self.arm.joint_names, self.q)

    @cached_property
    def moment_arms(self) -> MomentArms:
        """Moment arm of each cable about each joint, found by their names."""
        arm, values = self.arm, frozen(0.0 - self.length_jacobian)  # no zero is negative
        return MomentArms(
            values=values, cables=arm.cables.names, joints=arm.joint_names, slides=arm.slides
        )

    @cached_property
    def length_hessian(self) -> Array:
        """H_L[c, i, j] = ∂²L_c/∂θ_i∂θ_j, (C, nv, nv) [m/rad²], computed on first use."""
        routing, count = self.arm._model.routing, len(self.cable_lengths)
        hessian = stiffness_kernels.single_length_hessian(
            routing.segment, routing.joint, *self._frames, np.ones(count), np.arange(count), count
        )
        return frozen(hessian)

    @cached_property
    def cable_paths(self) -> tuple[Array, ...]:
        """Sites of each cable in base axes, one array (sites, 3) per cable [m]."""
        paths = site_paths(self.arm.cables, self._frames.site)
        return tuple(frozen(path.copy()) for path in paths)

    @property
    def joint_positions(self) -> Array:
        """Positions of the joints (nv, 3) [m]: one point on each joint axis."""
        return self._frames.origin[1:]

    @property
    def bones(self) -> tuple[Array, ...]:
        """The links as a stick figure: lines (2, 3) [m] from joint to joint and to the tip."""
        return tuple(bone for bones in self._bones for bone in bones)

    @property
    def brackets(self) -> tuple[Array, ...]:
        """Lines (2, 3) [m] from each cable site to the nearest of the bones of the site's link."""
        lines = []
        for row, site in zip(self.arm._model.routing.row, self._frames.site, strict=True):
            feet = [foot(site, bone) for bone in self._bones[row]] or [self._frames.origin[row]]
            nearest = min(feet, key=lambda each: float(np.linalg.norm(each - site)))
            lines.append(frozen(np.array([site, nearest])))
        return tuple(lines)

    def _stick_figure(self, without: Collection[int]) -> tuple[list[Array], list[Array]]:
        """Return :attr:`bones` and :attr:`brackets`, except those of the links in ``without``.

        A link is given by the number of the joint that carries it, from 1; 0 is the base.
        """
        rows = self.arm._model.routing.row.tolist()
        brackets = zip(rows, self.brackets, strict=True)
        return (
            [bone for row, each in enumerate(self._bones) if row not in without for bone in each],
            [bracket for row, bracket in brackets if row not in without],
        )

    @cached_property
    def _bones(self) -> tuple[tuple[Array, ...], ...]:
        """Lines (2, 3) [m] from the base, and from each joint, to the next joints or the tip."""
        origin, parent = self._frames.origin, self.arm._model.tree.parent
        ends = [*zip(parent[1:], origin[1:], strict=True)]
        bones: list[list[Array]] = [[] for _ in origin]
        for row, end in [*ends, (self.arm._model.masses.tip, self.tip[:3, 3])]:
            if (origin[row] != end).any():
                bones[row].append(frozen(np.array([origin[row], end])))
        return tuple(map(tuple, bones))

    def link_pose(self, link: str) -> Array:
        """Compute the pose (4, 4) [m] of a link's frame in base axes, or raise UnknownName."""
        return frozen(self.arm._model.body.placement(self.q, link))

    @cached_property
    def self_contacts(self) -> tuple[tuple[str, str], ...]:
        """Pairs of links that overlap, by name, but no neighbours: joint limits keep these apart.

        The body of a link is the cylinder around its disks. Overlaps raise no error. The result is
        empty for a robot from a URDF, since the shapes of its links are unknown.
        """
        if not self.arm.is_serpentine:
            return ()
        disks = self.arm.geometry.disks
        return tuple(overlapping(disks, {disk.link: self.link_pose(disk.link) for disk in disks}))

    @property
    def remarks(self) -> tuple[str, ...]:
        """One text, which names overlapping links, if the arm passes through itself; else none."""
        pairs = [" and ".join(pair) for pair in self.self_contacts]
        if not pairs:
            return ()
        return (f"the arm passes through itself: {listed(pairs, 3, '; ')}",)

    @cached_property
    def segments(self) -> Segments:
        """Lengths of cable segments between holes, and wrap angles; computed on first use."""
        model = self.arm._model
        found = chain_kernels.single_chains(model.arrays[:6], model.chain_arrays, self.q)
        lengths, jacobian, wrap, gradient, *frames = found
        return Segments(
            chains=model.chains,
            lengths=frozen(lengths),
            length_jacobian=frozen(jacobian),
            wrap=frozen(wrap),
            wrap_jacobian=frozen(gradient),
            _routing=Routing(*model.chain_arrays[:5]),
            _frames=Frames(*map(frozen, frames)),
        )

    def _equals(self, other: Posture) -> bool:
        return self is other or (self.arm == other.arm and np.array_equal(self.q, other.q))

    def _joint_stiffness(self, tension: Array, cable_stiffness: Array, wrench: Array) -> Array:
        """Compute five matrices (5, nv, nv) [N m/rad]: active, passive and load term, P, and K_θ.

        P is the entrywise sum of the magnitudes of the four terms of K_θ. ``tension`` (C,) [N],
        ``cable_stiffness`` (C,) [N/m] and ``wrench`` (6,) must be checked.
        """
        model = self.arm._model
        terms = stiffness_kernels.single_stiffness(
            model.routing.segment,
            model.routing.joint,
            *self._frames,
            self.jacobian,
            self.length_jacobian,
            self.gravity_stiffness,
            tension,
            cable_stiffness,
            wrench,
            model.masses.tip_joints,
        )
        return frozen(terms)


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class MomentArms(ReadOnlyState):
    """Moment arm of each cable about each joint, −J_L: torque per tension, τ = −J_Lᵀ F (Eq. 13).

    A cable with a positive moment arm turns the joint to positive angles. The moment arm of one
    cable about one joint is ``arms["cable1_1", "joint1_1"]``.

    Attributes:
        values: Moment arms (C, nv) [m]; force per tension [-] for prismatic joints.
        cables: Names of the cables.
        joints: Names of the joints.
        slides: Whether each joint is prismatic (nv,).
    """

    values: Array
    cables: tuple[str, ...]
    joints: tuple[str, ...]
    slides: NDArray[np.bool_]

    def __getitem__(self, names: tuple[str, str]) -> float:
        """Return the moment arm of a cable about a joint [m], or [-] for a prismatic joint.

        Raises InvalidInput if there are not two names, UnknownName for an unknown name.
        """
        if not isinstance(names, tuple) or len(names) != 2:
            raise InvalidInput(
                "moment_arms",
                f"{names!r} given; give a cable and a joint, such as "
                f'moment_arms["{self.cables[0]}", "{self.joints[0]}"].',
            )
        cable, joint = names
        row = self.cables.index(one_of("cable", cable, self.cables))
        return float(self.values[row, self.joints.index(one_of("joint", joint, self.joints))])

    def to_dict(self) -> dict[str, object]:
        """Return the moment arms by cable and joint for JSON; the keys name the SI units."""
        found: dict[str, object] = {}
        for name, chosen in (("moment_arm_m", ~self.slides), ("force_per_tension", self.slides)):
            columns = np.flatnonzero(chosen).tolist()
            if columns:
                found[name] = {
                    cable: {self.joints[i]: float(row[i]) for i in columns}
                    for cable, row in zip(self.cables, self.values, strict=True)
                }
        return found

    def to_pandas(self) -> pandas.DataFrame:
        """Return a pandas table in SI: a row for each cable, a column for each joint.

        Raises MissingExtra if pandas is not installed.
        """
        units = np.where(self.slides, "-", "m").tolist()
        names = [f"{joint} [{unit}]" for joint, unit in zip(self.joints, units, strict=True)]
        return data_frame(dict(zip(names, self.values.T, strict=True)), "cable", self.cables)

    def __repr__(self) -> str:
        cables, joints = plural(len(self.cables), "cable"), plural(len(self.joints), "joint")
        return f"<MomentArms of {cables} about {joints}>"

    def __str__(self) -> str:
        scale = np.where(self.slides, 1.0, 1e3)
        rows = [
            [cable, *(f"{arm:z.2f}" for arm in scale * row)]
            for cable, row in zip(self.cables, self.values, strict=True)
        ]
        slide = " [-] where the joint slides;" if self.slides.any() else ""
        note = f"moment arms [mm],{slide} positive: the cable turns the joint to positive angles"
        return "\n".join([*aligned([["", *self.joints], *rows]), note])


def site_paths(cables: Sequence[Cable], sites: Array) -> list[Array]:
    """Divide the positions of all cable sites, (P, 3) [m], into one array for each cable."""
    return np.split(sites, np.cumsum([len(cable.sites) for cable in cables])[:-1])


def foot(point: Array, line: Array) -> Array:
    """Return the point (3,) of a line segment ``line`` (2, 3) that is nearest to ``point`` (3,)."""
    span = line[1] - line[0]
    return np.asarray(line[0] + np.clip((point - line[0]) @ span / (span @ span), 0.0, 1.0) * span)
