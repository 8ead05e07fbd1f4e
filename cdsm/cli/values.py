"""Read the values of options: numbers, axes, joint coordinates."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import chain
from typing import TYPE_CHECKING

import typer

import cdsm

if TYPE_CHECKING:
    from cdsm.support.values import Array


def misuse(option: str, problem: str) -> typer.BadParameter:
    """Return the error to raise for a wrong value of ``option``."""
    return typer.BadParameter(problem, param_hint=option)


def joint_scales(arm: cdsm.Manipulator) -> Array:
    """Return the SI value (nv,) of the unit of each joint on the command line: 1° or 1 mm."""
    import numpy as np

    from cdsm.support.format import JointUnits

    return np.array([scale for _, scale in JointUnits(arm.slides).shown])


def coordinates(text: str, arm: cdsm.Manipulator) -> list[float]:
    """Return the joint coordinates of --angles (nv,) [degrees, or mm if prismatic]."""
    if "=" in text:
        named = {
            name: numbers("--angles", value, 1, f"an angle, as {name}=10")[0]
            for name, value in by_joint("--angles", text, arm, "JOINT=DEG,...").items()
        }
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


def by_joint(option: str, text: str, arm: cdsm.Manipulator, form: str) -> dict[str, str]:
    """Split the text of an option into entries ``JOINT=VALUE``; return the values by joint.

    Commas or spaces separate the entries, but joint names may also contain commas, spaces and
    ``=``. Raises BadParameter if the text does not begin with a joint (the message then shows
    ``form``) or names a joint twice; UnknownName if the arm has no such joint.
    """
    from cdsm.support.validation import one_of

    names = "|".join(re.escape(name) for name in sorted(arm.joint_names, key=len, reverse=True))
    found = list(re.finditer(rf"(?:^|[,\s])\s*({names})\s*=", text))
    ends = [each.start() for each in found] + [len(text)]
    values: dict[str, str] = {}
    texts = [text[each.end() : end] for each, end in zip(found, ends[1:], strict=True)]
    for value in (text[: ends[0]], *texts):
        unknown, equals, _ = value.rpartition("=")
        if equals:
            words = unknown.split("," if "," in unknown else None)
            one_of("joint", words[-1].strip() if words else "", arm.joint_names)
    if ends[0]:
        raise misuse(option, f"{text[: ends[0]]!r} given; {form} is needed.")
    for each, value in zip(found, texts, strict=True):
        if each[1] in values:
            raise misuse(option, f"{each[1]} is given twice.")
        values[each[1]] = value.strip(", ")
    return values


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
    """Return the numbers in the text of an option: ``count`` of them, or any number if None.

    Raises BadParameter for another text or count; the message shows ``form``: ``FX,FY,FZ``.
    """
    from cdsm.support.format import plural

    values = []
    between = [""] if "," in text else []  # an empty entry between two commas is told
    for word in chain.from_iterable(part.split() or between for part in text.split(",")):
        try:
            values.append(float(word))
        except ValueError:
            raise misuse(option, f"{word!r} is no number; give {form}.") from None
    if count is not None and len(values) != count:
        counted = f"{plural(len(values), 'number')} given; give {count}: {form}."
        raise misuse(option, counted)
    return values
