"""Joint limits: which angles are beyond them, and the error that names these joints."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from cdsm.errors import InvalidInput, listed
from cdsm.rigid_body import RigidBody
from cdsm.status import Status
from cdsm.support.format import beyond
from cdsm.support.values import Array

_STAY = "Stay inside, or widen joint_limit in the geometry (limit of a joint, or in a URDF)"

_DEGREES = ", or, in Python, give radians: np.deg2rad(q), if these are degrees"

UNCHECKED = ", or, in Python, pass check_limits=False to compute beyond them"
"""What the error of angles beyond their limits advises besides, where that can be done."""


def beyond_limits(body: RigidBody, q: Array) -> NDArray[np.bool_]:
    """Return for each joint angle of q (…, nv) whether it is beyond its limits (…, nv)."""
    return np.asarray((q < body.lowest) | (q > body.highest))


def require_within_limits(body: RigidBody, q: Array) -> None:
    """Raise InvalidInput if an angle of q (nv,) is beyond its limits."""
    outside = beyond_limits(body, q)
    if not outside.any():
        return
    texts = []
    for i in np.flatnonzero(outside).tolist():
        values = float(q[i]), float(body.lower[i]), float(body.upper[i])
        narrowed = f", narrowed by {listed(followers)}" if (followers := body.narrowing[i]) else ""
        texts.append(beyond(body.joint_names[i], *values, body.joint_units[i]) + narrowed)
    turned = q[outside & ~body.slides]
    remedy = _DEGREES if abs(turned).max(initial=0.0) > math.pi else UNCHECKED
    message = f"{listed(texts, 4, '; ')}. {_STAY}{remedy}."
    raise InvalidInput("q", message, Status.BEYOND_LIMITS)
