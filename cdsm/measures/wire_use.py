"""How far wires are used: strain, safety against breaking, life under bending over holes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, final

import numpy as np

from cdsm.errors import ElasticityRangeError
from cdsm.manipulator import Manipulator
from cdsm.support.format import aligned, plain
from cdsm.support.validation import flag, instance, quantity
from cdsm.support.values import Array, ReadOnlyState, frozen
from cdsm.tension import Tension, grip

ROPE_WIRE: Final = 1770e6
"""Strength of the usual grade of rope wire [Pa]."""

LONG_LIFE: Final = 0.001
"""Ratio of bearing pressure to strength below which wire rope on sheaves has a long life [-]."""


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class WireUse(ReadOnlyState):
    """Strain, safety and life margin of each cable; made by :func:`wire_use`.

    Attributes:
        tension: The tensions and their posture.
        largest: Largest tension along each cable (C,) [N]: F, or more with ``worst_friction``.
        strain: Strain ε of each cable under ``largest`` (C,) [-].
        safety: Breaking load divided by ``largest`` (C,) [-].
        bend_ratio: D/d, the diameter of the bend divided by the diameter of the wire [-].
        life_margin: 0.001 divided by the ratio of bearing pressure to strength (C,) [-]; a long
            life needs at least 1.
    """

    tension: Tension
    largest: Array
    strain: Array
    safety: Array
    bend_ratio: float
    life_margin: Array

    def to_dict(self) -> dict[str, object]:
        """Return all numbers by cable, in SI, for JSON."""
        names = self.tension.keys()
        columns = {
            "largest_tension_N": self.largest,
            "strain": self.strain,
            "safety": self.safety,
            "life_margin": self.life_margin,
        }
        each = {key: dict(zip(names, values, strict=True)) for key, values in columns.items()}
        return plain({**each, "bend_ratio": self.bend_ratio})

    def __repr__(self) -> str:
        return (
            f"<WireUse: safety {self.safety.min():.3g}, life margin {self.life_margin.min():.3g}>"
        )

    def __str__(self) -> str:
        columns = np.transpose([self.largest, self.strain, self.safety, self.life_margin])
        rows = [
            [name, f"{F:.2f}", f"{1e3 * e:.3f}", f"{s:.3g}", f"{m:.3g}"]
            for name, (F, e, s, m) in zip(self.tension.keys(), columns, strict=True)
        ]
        head = ["cable", "largest [N]", "strain [1e-3]", "safety", "life margin"]
        return "\n".join([*aligned([head, *rows]), f"D/d: {self.bend_ratio:.3g}"])


def wire_use(
    tension: Tension,
    *,
    diameter: float,
    breaking_load: float,
    bend_diameter: float,
    strength: float = ROPE_WIRE,
    worst_friction: bool = False,
) -> WireUse:
    """Compute strain, safety and life margin of the wires under tensions.

    The bearing pressure of a wire on a bend is p = 2F/(d D) (Drucker and Tachau, J. Appl. Mech. 12,
    1945). Wire rope has a long life where p/S_u is below 0.001 (Shigley's Mechanical Engineering
    Design, section 17-6); the life margin is 0.001 S_u/p. This rule is for rope on sheaves. For the
    edge of a hole it compares designs but gives no number of cycles.

    Args:
        tension: The tensions.
        diameter: d of the wire [m].
        breaking_load: Breaking load of the wire [N].
        bend_diameter: D: diameter of the bend on which the wire lies in its holes [m].
        strength: S_u of its material [Pa]; the usual grade of rope wire, 1770 N/mm², by default.
        worst_friction: Take the largest tension that friction can cause along each cable,
            F exp(Σ μ φ).

    Raises:
        InvalidInput: An argument is not positive, or not of a size that machines have.
        ElasticityRangeError: A tension is outside the domain of the law of its cable.
    """
    instance("tension", tension, Tension)
    d = quantity("diameter", diameter, "diameter")
    D = quantity("bend_diameter", bend_diameter, "length")
    limit = quantity("breaking_load", breaking_load, "force")
    S = quantity("strength", strength, "stiffness")
    F = tension.values
    largest = F * np.exp(grip(tension.posture)) if flag("worst_friction", worst_friction) else F
    arm = tension.posture.arm
    strain = np.empty_like(F)
    for c, cable in enumerate(arm.cables):
        try:
            strain[c] = cable.elasticity.strain(largest[c])
        except ElasticityRangeError as error:
            raise ElasticityRangeError(error.problem, error.tension, [c], [cable.name]) from None
    return WireUse(
        tension=tension,
        largest=frozen(np.array(largest)),
        strain=frozen(strain),
        safety=frozen(safety(largest, limit)),
        bend_ratio=D / d,
        life_margin=frozen(life_margin(largest, d, D, S)),
    )


def safety(tension: Array, breaking_load: float) -> Array:
    """Return ``breaking_load`` [N] divided by ``tension`` (…,) [N]; inf where a cable is slack."""
    with np.errstate(divide="ignore"):
        return np.where(tension > 0.0, breaking_load / tension, math.inf)


def strains(arm: Manipulator, tension: Array) -> Array:
    """Return strains ε(F) (B, C) [-] of tensions (B, C) [N]; NaN outside the domain of a law."""
    found = np.full(tension.shape, math.nan)
    for c, cable in enumerate(arm.cables):
        law, F = cable.elasticity, tension[:, c]
        inside = (law.low <= F) & (law.high >= F)
        found[inside, c] = law.strain(F[inside])
    return found


def life_margin(
    tension: Array, diameter: float, bend_diameter: float, strength: float = ROPE_WIRE
) -> Array:
    """Compute the life margin 0.001 S_u/p (…,) [-] of wires under tensions F (…,) [N]; inf at 0 N.

    p = 2F/(d D) is the bearing pressure, S_u ``strength`` [Pa], d ``diameter`` and D
    ``bend_diameter`` [m], as in :func:`wire_use`.
    """
    with np.errstate(divide="ignore"):
        pressure = 2.0 * tension / (diameter * bend_diameter)
        return np.where(tension > 0.0, LONG_LIFE * strength / pressure, math.inf)
