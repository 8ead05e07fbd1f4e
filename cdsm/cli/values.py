"""Read the values of options: numbers, axes, joint coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import typer

import cdsm

if TYPE_CHECKING:
    from cdsm.support.values import Array


def misuse(option: str, problem: str) -> typer.BadParameter:
    """Return the error of a wrong value of ``option``."""
    return typer.BadParameter(problem, param_hint=option)


def joint_scales(arm: cdsm.Manipulator) -> Array:
    """Return the factor from each joint's unit on the command line to SI (nv,): of 1° or 1 mm."""
    import numpy as np

    from cdsm.support.format import JointUnits

    return np.array([scale for _, scale in JointUnits(arm.slides).shown])


def coordinates(text: str, arm: cdsm.Manipulator) -> list[float]:
    """Return the joint coordinates of --angles (nv,) [degrees, or mm where a joint slides]."""
    from cdsm.support.validation import one_of

    if "=" in text:
        named: dict[str, float] = {}
        for part in text.replace(",", " ").split():
            name, _, value = part.partition("=")
            if one_of("joint", name, arm.joint_names) in named:
                raise misuse("--angles", f"{name} is given twice.")
            named[name] = numbers("--angles", value, 1, f"an angle, as {name}=10")[0]
        return [named.get(name, 0.0) for name in arm.joint_names]
    given = numbers("--angles", text)
    given = given * arm.nv if len(given) == 1 else given
    if len(given) != arm.nv:
        names = ", ".join(arm.joint_names)
        raise misuse(
            "--angles",
            f"{len(given)} given; give one angle, one for each of {names}, or some by name, such "
            f"as {arm.joint_names[-1]}=10.",
        )
    return given


def axis(text: str) -> tuple[float, float, float] | None:
    """Return the unit vector of an axis such as ``-z``; None if the text is not an axis."""
    from cdsm.support.directions import AXES

    return AXES.get(text.strip())


def direction_of(text: str) -> Sequence[float]:
    """Return the direction (3,) of --direction: an axis, or three numbers."""
    return axis(text) or numbers("--direction", text, 3, "an axis such as -y, or X,Y,Z")


def gravity_of(text: str) -> list[float] | str:
    """Return gravity (3,) [m/s²], or the name of the axis along which it is 9.81 m/s²."""
    word = text.strip()
    return word if axis(word) else numbers("--gravity", text, 3, "an axis such as -y, or GX,GY,GZ")


def numbers(option: str, text: str, count: int | None = None, form: str = "N,N,...") -> list[float]:
    """Return the ``count`` numbers in the text of an option; None: any count.

    BadParameter otherwise; its message says that ``form`` is needed, such as ``FX,FY,FZ``.
    """
    from cdsm.support.format import plural

    values = []
    for word in text.replace(",", " ").split():
        try:
            values.append(float(word))
        except ValueError:
            raise misuse(option, f"{word!r} is no number; give {form}.") from None
    if count is not None and len(values) != count:
        counted = f"{plural(len(values), 'number')} given; give {count}: {form}."
        raise misuse(option, counted)
    return values
