"""What derivatives are checked against: central differences that converge at the rate they must."""

from collections.abc import Callable

import numpy as np

import cdsm
from cdsm.support.values import Array
from cdsm.urdf import CROSS_MASS

EPSILON = float(np.finfo(np.float64).eps)


def central_difference(f: Callable[[Array], Array], x: Array, step: float) -> Array:
    """∂f/∂x by central differences: the shape of f, with one more axis at the end for x."""
    columns = [(f(x + e) - f(x - e)) / (2.0 * step) for e in step * np.eye(x.size)]
    return np.stack(columns, axis=-1)


def assert_second_order(
    f: Callable[[Array], Array],
    analytic: Array,
    x: Array,
    *,
    order: int = 1,
    step: float = 2.0**-8,
    size: float = 1.0,
    tolerance: float = 1e-10,
) -> None:
    """Assert that differences of f at x converge to its analytic derivative, at the rate h².

    At the steps h, h/2 and h/4 the error has to fall by four each time, which an analytic
    derivative that is off by anything but rounding does not allow; and the three together, with h²
    and h⁴ extrapolated away, have to agree with it to ``tolerance`` of its largest entry. Where the
    differences have no error but rounding (f linear or constant), rounding is all that is allowed.

    ``analytic`` has one axis for x behind those of f, or two for ``order`` 2, the Hessian. ``step``
    is h: powers of two are halved without rounding. ``size`` is the magnitude of the numbers that f
    is computed from: they set the rounding. The default ``tolerance`` is what rounding leaves of a
    moment arm of 1 cm: some 1e-16 m over the smallest step of 1e-3 rad, and ten times that.
    """

    def estimate(h: float) -> Array:
        def gradient(y: Array) -> Array:
            return central_difference(f, y, h)

        return gradient(x) if order == 1 else central_difference(gradient, x, h)

    steps = (step, step / 2.0, step / 4.0)
    values = [estimate(h) for h in steps]
    assert values[0].shape == analytic.shape, f"{analytic.shape}, should be {values[0].shape}"
    errors = np.array([abs(value - analytic).max() for value in values])
    # a difference of order p divides the rounding of f, a few units in the last place, by h^p
    rounding = 10.0 * EPSILON * size / np.power(steps, order)
    if (errors <= rounding).all():
        return
    assert (errors > 10.0 * rounding).all(), (
        f"errors {errors} are neither rounding, {rounding}, nor far above it"
    )
    rates = np.log2(errors[:-1] / errors[1:])
    # the rate itself is off 2 by order h²: 4e-4 at most where segments of cable get short
    assert (abs(rates - 2.0) < 0.02).all(), f"the errors {errors} fall at the rates {rates}, not 2"
    a, b, c = values
    extrapolated = (16.0 * (4.0 * c - b) / 3.0 - (4.0 * b - a) / 3.0) / 15.0
    off = abs(extrapolated - analytic).max() / abs(analytic).max()
    assert off < tolerance, f"off by {off:.2e} of the largest entry after extrapolation"


def gravity_energy(pose: cdsm.Posture) -> float:
    """Potential energy of the weight, from nothing but the places and masses of the links."""
    energy = 0.0
    geometry = pose.arm.geometry
    for k, (joint, link) in enumerate(zip(geometry.joints, geometry.links, strict=True), start=1):
        frame = pose.link_pose(f"link{k}")
        centre = frame[:3, 3] + frame[:3, 0] * link.length / 2.0
        energy -= (link.mass or CROSS_MASS) * float(pose.arm.gravity @ centre)
        if len(joint.axes) == 2:
            cross = pose.link_pose(f"cross{k}")[:3, 3]
            energy -= CROSS_MASS * float(pose.arm.gravity @ cross)
    return energy
