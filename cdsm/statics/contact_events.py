"""Pulleys whose contact with their cable is watched while a load grows."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.statics.events import Kind
from cdsm.support.values import Array

_BESIDE = math.radians(0.1)  # angle to the plane of a groove at which a cable snaps out of it


def contact_names(arm: Manipulator) -> list[str]:
    """Return a name for the contact of each pulley (P,): its cable, and where the pulley is."""
    if arm.wraps is None:
        return []
    labels = map(arm.wraps.label, range(len(arm.wraps.pulleys)))
    return [f"{cable} on {pulley}" for cable, pulley in labels]


def contact_angles(pose: Posture) -> Array:
    """Return the wrap angle of each pulley (P,) [rad], negative where the cable does not touch."""
    if pose.wrapping is None:
        return np.zeros(0)
    angle = abs(pose.wrapping.angle)
    return np.asarray(np.where(pose.wrapping.touches, angle, -angle))


def contact_kinds(arm: Manipulator) -> tuple[list[Kind], list[str]]:
    """Return the events of contacts that an arm is watched for (2P,), and their places."""
    names = contact_names(arm)
    lifts: list[Kind] = ["lift-off"] * len(names)
    touches: list[Kind] = ["contact"] * len(names)
    return lifts + touches, names + names


def contact_values(pose: Posture) -> Array:
    """Return what is negative after each event of :func:`contact_kinds` (2P,) [rad]."""
    wrap = contact_angles(pose)
    return np.append(wrap, -wrap)


def contact_kind(kinds: Sequence[Kind], i: int, before: Posture) -> Kind:
    """Return the kind of event i, where the posture ``before`` it is known.

    A cable that lifts off beside the plane of a groove leaves it with a step of its length.
    """
    kind = kinds[i]
    if kind == "lift-off" and is_beside_groove(before, i - kinds.index("lift-off")):
        return "groove"
    return kind


def is_beside_groove(pose: Posture, pulley: int) -> bool:
    """Return whether the cable leaves a groove beside its plane: there its length has a step."""
    wrapping = pose.wrapping
    if wrapping is None or not wrapping.wraps.groove[pulley]:
        return False
    at = np.flatnonzero(wrapping.pattern.pulley == pulley)
    fleet = wrapping.shifts.fleet.reshape(2, -1)[:, at]
    return bool((abs(np.nan_to_num(fleet)) > _BESIDE).any())
