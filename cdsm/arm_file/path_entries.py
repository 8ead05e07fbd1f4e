"""Entries of a cable's path in ARM.toml: sites, pulleys, pulleys at joints, sheaths.

A key tells which one it is: ``sheath``, else ``joint``, else ``radius``, else it is a site.
"""

from __future__ import annotations

from dataclasses import fields
from typing import Annotated, Any, Final, Literal

from pydantic import Discriminator, Field, Tag

from cdsm.cable_path import JointPulley, PathElement, Pulley, Sheath, Site
from cdsm.support import records
from cdsm.support.records import record

Label = Annotated[str, Field(min_length=1, max_length=200)]


@record
class _Site:
    link: Label
    xyz: records.Position
    friction: records.FrictionCoefficient | None = None
    wrap: records.Wrap = 0.0

    def built(self, friction: float) -> Site:
        """Return the site; ``friction`` is that of a hole without one of its own."""
        own = friction if self.friction is None else self.friction
        return Site(self.link, self.xyz, own, self.wrap)


@record
class _OnPulley:
    radius: records.Number
    groove: bool = True
    turns: records.Integer = 0
    friction: records.FrictionCoefficient = 0.0
    bearing: records.Number = 0.0

    @property
    def _shared(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in _OF_PULLEYS}


_OF_PULLEYS: Final = "radius", "groove", "turns", "friction", "bearing"


@record
class _Pulley(_OnPulley):
    link: Label
    xyz: records.Position
    axis: records.Vector

    def built(self, _: float) -> Pulley:
        """Return the pulley."""
        return Pulley(link=self.link, position=self.xyz, axis=self.axis, **self._shared)


@record
class _JointPulley(_OnPulley):
    joint: Label
    turn: Literal["+", "-"] = "+"

    def built(self, _: float) -> JointPulley:
        """Return the pulley at a joint."""
        return JointPulley(joint=self.joint, turn=self.turn, **self._shared)


@record
class _Sheath:
    sheath: records.Length
    wrap: records.Wrap = 0.0
    friction: records.FrictionCoefficient = 0.0
    pieces: records.Integer = 8

    def built(self, _: float) -> Sheath:
        """Return the sheath."""
        return Sheath(self.sheath, self.wrap, self.friction, self.pieces)


_KINDS: Final = ("sheath", "joint", "radius")
_SITE: Final = "site"


def _kind(entry: Any) -> str:
    keys = entry if isinstance(entry, dict) else {}
    return next((f"({key})" for key in _KINDS if key in keys), f"({_SITE})")


PathEntry = Annotated[
    Annotated[_Site, Tag(f"({_SITE})")]
    | Annotated[_Pulley, Tag("(radius)")]
    | Annotated[_JointPulley, Tag("(joint)")]
    | Annotated[_Sheath, Tag("(sheath)")],
    Discriminator(_kind),
]
"""One entry of ``sites``."""


def entry_table(element: PathElement) -> dict[str, Any]:
    """Return the TOML table of an entry, without what is the default."""
    usual = {field.name: field.default for field in fields(element)}
    values = {field.name: getattr(element, field.name) for field in fields(element)}
    renamed = {"position": "xyz"} | ({"length": "sheath"} if isinstance(element, Sheath) else {})
    return {
        renamed.get(name, name): value for name, value in values.items() if value != usual[name]
    }
