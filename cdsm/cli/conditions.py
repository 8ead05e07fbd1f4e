"""Print the assumptions of a result (wire, gravity, least tension, friction) and its posture."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cdsm

if TYPE_CHECKING:
    from cdsm.cli.output import Json


@dataclass(frozen=True)
class Conditions:
    """First lines of a printed answer: the assumptions, the arm, and the posture if given."""

    of: cdsm.Manipulator | cdsm.Posture  # the arm, or the only posture of the results
    minimum: tuple[float, ...] = ()  # given lower bounds of all tensions [N], one per case
    friction: bool = False  # whether the results include the friction of the arm
    planned: bool = False  # whether tensions are planned, so within the domains of the laws

    @property
    def arm(self) -> cdsm.Manipulator:
        """The arm of the results."""
        return self.of.arm if isinstance(self.of, cdsm.Posture) else self.of

    def __str__(self) -> str:
        from cdsm.support.format import coordinates, place

        x, y, z = self.arm.gravity.tolist()
        words = [f"wire {self.wire}", f"gravity {x:g}, {y:g}, {z:g} m/s²"]
        if self.minimum:
            words.append(f"least tension {', '.join(f'{each:g}' for each in self.minimum)} N")
            own = max(cable.minimum for cable in self.arm.cables)
            if own > min(self.minimum):
                words[-1] += f" (cables of their own up to {own:g} N)"
            held = [cable for cable in self.arm.cables if cable.control == "position"]
            first = max((cable.elasticity.low for cable in held), default=0.0)
            if self.planned and first > max(own, *self.minimum):
                words[-1] += f" (raised to {first:g} N, where the law of a wire begins)"
        if self.arm.original_length != "unstrained":
            words.append("stretched lengths")
        words.append(self._friction)
        lines = [f"with {'; '.join(words)}", str(self.arm)]
        if isinstance(self.of, cdsm.Posture):
            q = zip(self.of.q.tolist(), self.arm.joint_units, strict=True)
            joints = ", ".join(place(value, unit) for value, unit in q)
            lines.append(f"at {joints}; tip at {coordinates(1e3 * self.of.tip[:3, 3])} mm")
        return "\n".join(lines)

    @property
    def _friction(self) -> str:
        if not self.arm.has_friction:
            return "frictionless"
        if not self.friction:
            return "friction of its holes left out"
        found = [mu for cable in self.arm.cables for mu in cable.friction]
        low, high = min(found), max(found)
        return f"friction {low:g}" + (f" to {high:g}" if high > low else "")

    @property
    def wire(self) -> str:
        """Wires of the cables and springs in series with them, as text."""
        from cdsm.wires.catalogue import wires_text

        return wires_text(self.arm.cables)

    def to_dict(self) -> Json:
        """Return the assumptions for JSON, in SI units."""
        return {
            "computed_with": {
                "wire": self.wire,
                "gravity_m_per_s2": self.arm.gravity,
                "least_tension_N": list(self.minimum),
                "original_length": self.arm.original_length,
                "friction": ("included" if self.friction else "left out")
                if self.arm.has_friction
                else "none",
            }
        }
