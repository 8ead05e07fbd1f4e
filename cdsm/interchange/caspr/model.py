"""A robot from its two files."""

from __future__ import annotations

import os
from pathlib import Path

from numpy.typing import ArrayLike

from cdsm.elasticity import Elasticity
from cdsm.errors import FileError, InvalidInput
from cdsm.interchange.caspr.bodies import read_bodies
from cdsm.interchange.caspr.cables import read_cables
from cdsm.interchange.caspr.urdf import to_urdf
from cdsm.manipulator import GRAVITY, Manipulator
from cdsm.support.files import as_path
from cdsm.urdf import TIP


def read_caspr(
    bodies: str | os.PathLike[str],
    cables: str | os.PathLike[str] | None = None,
    *,
    elasticity: Elasticity,
    cable_set: str | None = None,
    gravity: ArrayLike = GRAVITY,
    check_inertia: bool = True,
) -> Manipulator:
    """Read a robot from its CASPR model files.

    Links keep CASPR's names (or become ``link1``, ``link2``, … where a name is missing or used
    twice), link 0 is called ``base``; a joint becomes single joints called after their link and
    axis: ``link 1_x`` turns about x, ``link 1_slide_x`` moves along it. ``tool0`` sits at the end
    of the link with the highest number. A cable whose name has been used gets ``#2`` behind it.
    The joint coordinates q are CASPR's own, sign and order: link by link as the links are numbered,
    and for each link as its joint type is named, ways first (``S_FIXED_XYZ``: the angles x, y, z;
    ``PLANAR_XZ``: the ways x and z, then the angle). ``joint_names`` of the arm lists them.
    Force bounds become ``Cable.minimum`` and ``.maximum``.
    CASPR's cables do not stretch: their elasticity is up to you.

    Args:
        bodies: The file of the bodies, or the folder with one ``*_bodies.xml`` and one
            ``*_cables.xml``.
        cables: The file of the cables, if ``bodies`` is a file.
        elasticity: Of all cables.
        cable_set: Which set of cables; the file's default if not given.
        gravity: In base axes (3,) [m/s²].
        check_inertia: As for :meth:`Manipulator.from_urdf`.

    Raises:
        FileError: A file cannot be read or is no CASPR model, or has what cannot be mapped: other
            joints, other cables than ideal ones, pulleys. Every such thing is named.
        UrdfError: A link has moments of inertia that no body has.
        UnknownName: No such set of cables.
        CableError: A cable that cannot be routed.
    """
    if not isinstance(elasticity, Elasticity):
        raise InvalidInput("elasticity", f"{elasticity!r} given; an Elasticity is needed.")
    bodies_file, cables_file = _files(bodies, cables)
    links = read_bodies(bodies_file)
    routed = read_cables(cables_file, links, elasticity, cable_set)
    urdf = to_urdf(bodies_file.stem.removesuffix("_bodies"), links)
    return Manipulator.from_urdf(
        urdf,
        routed,
        tip=TIP,
        joint_names=[name for link in links for name in link.joint_names],
        gravity=gravity,
        check_inertia=check_inertia,
    )


def _files(
    bodies: str | os.PathLike[str], cables: str | os.PathLike[str] | None
) -> tuple[Path, Path]:
    first = as_path(bodies)
    if not first.is_dir():
        if cables is None:
            raise InvalidInput(
                "cables", "not given; give the file of the cables too, or the folder of both."
            )
        return first, as_path(cables)
    found = []
    for kind in ("bodies", "cables"):
        files = sorted(first.glob(f"*_{kind}.xml"))
        if len(files) != 1:
            listed = ", ".join(file.name for file in files) or "none"
            raise FileError(first, f"holds {listed} where one *_{kind}.xml is needed.")
        found.append(files[0])
    return found[0], found[1]
