"""Write arms that people know from papers into this folder: one ARM.toml and one URDF each.

    python urdf/generate.py

Two are the prototypes of the paper that cdsm implements, with what is assumed of them. Four have
the dimensions of models of CASPR (darwinlau/CASPR, BSD-3-Clause, commit a6971ee), one is a
structure that was measured. A TOML keeps the comment at its head: where its numbers are from.
"""

import re
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import cdsm
from cdsm import paper, presets
from cdsm.presets.bodies import JOINT_AXES, SerialBody, Triple, chain

FOLDER = Path(__file__).parent
X, Y, Z = JOINT_AXES
WIRE = cdsm.LinearElasticity(48e3)  # EA [N] of a steel strand of 1.2 mm; CASPR's do not stretch
Route = Sequence[tuple[str, Triple]]  # sites of a cable: link and point


def arm_of(
    name: str, bodies: Sequence[SerialBody], tip: Triple, routes: Sequence[Route], **bounds: float
) -> cdsm.Manipulator:
    """Build an arm from bodies in series and the routes of its cables."""
    cables = [
        cdsm.Cable(f"cable{k}", tuple(cdsm.Site(*site) for site in sites), WIRE, **bounds)  # type: ignore[arg-type]
        for k, sites in enumerate(routes, start=1)
    ]
    return cdsm.Manipulator.from_urdf(chain(name, bodies, tip), cables, tip="tool0")


def carex() -> cdsm.Manipulator:
    """Build the exoskeleton of Mao and Agrawal (2012): shoulder and elbow, 6 cables."""
    centre, inertia = (0.0, 0.0, -0.13), (0.0225, 0.0225, 1e-4)
    upper = SerialBody("upper_arm", (0.0, 0.0, 0.0), (X, Y, Z), 3.1416, 3.0, centre, inertia)
    centre, inertia = (0.0, 0.0, -0.12), (0.0131, 0.0131, 1e-4)
    fore = SerialBody("forearm", (0.0, 0.0, -0.3), (Y,), 3.1416, 2.0, centre, inertia)
    front, back, side = (0.2, 0.0, 0.0), (-0.2, 0.0, 0.0), (0.1732, 0.0, 0.1)
    routes: list[Route] = [
        [("base", front), ("upper_arm", (0.065, 0.0, -0.26)), ("forearm", (0.06, 0.0, -0.24))],
        [("base", front), ("upper_arm", (0.0, -0.065, -0.26))],
        [("base", back), ("upper_arm", (-0.065, 0.0, -0.26)), ("forearm", (-0.06, 0.0, -0.24))],
        [("base", back), ("upper_arm", (0.0, -0.065, -0.26))],
        [("base", back), ("upper_arm", (-0.046, 0.046, -0.26))],
        [("base", side), ("upper_arm", (0.046, 0.046, -0.26))],
    ]
    return arm_of("carex", [upper, fore], (0.0, 0.0, -0.28), routes, minimum=3.0, maximum=45.0)


def myo_shoulder() -> cdsm.Manipulator:
    """Build the shoulder of the robot of Richter et al. (2016): 3 joints in one point, 9 cables."""
    zero, ones = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
    upper = SerialBody("upper_arm", zero, (X, Y, Z), 3.1416, 1.0, (0.0, 0.0, -0.225), ones)
    ends: list[tuple[Triple, Triple]] = [
        ((-0.06, 0.045, -0.1), (-0.015, 0.015, -0.045)),
        ((-0.06, 0.08, -0.05), (0.015, 0.015, -0.03)),
        ((-0.06, 0.082, 0.01), (0.015, 0.025, -0.175)),
        ((-0.015, 0.045, 0.038), (0.0, 0.025, -0.335)),
        ((0.05, 0.0, 0.04), (0.015, 0.025, -0.175)),
        ((0.015, -0.045, 0.005), (0.015, 0.025, -0.175)),
        ((-0.06, -0.08, 0.01), (0.015, -0.015, -0.03)),
        ((-0.06, -0.082, -0.05), (0.015, -0.015, -0.04)),
        ((-0.06, -0.055, -0.1), (0.015, -0.015, -0.05)),
    ]
    routes, tip = [[("base", start), ("upper_arm", end)] for start, end in ends], (0.0, 0.0, -0.45)
    return arm_of("myo_shoulder", [upper], tip, routes, minimum=0.1, maximum=1000.0)


def bm_arm() -> cdsm.Manipulator:
    """Build the BM-Arm of CASPR: shoulder and elbow, 6 cables; the straight arm points along y."""
    centre, inertia = (6.11879e-5, 0.142722, 9.20007e-5), (0.0217208, 2.0494929e-4, 0.0217454)
    upper = SerialBody("upper_arm", (0.0, 0.0, 0.0), (X, Y, Z), 1.0, 0.9810187, centre, inertia)
    centre, inertia = (0.0, 0.0801433, 0.0), (4.9116366e-4, 1.9877175e-5, 4.9029819e-4)
    lower = SerialBody("lower_arm", (0.0, 0.367, 0.0), (X,), 1.0, 0.1313765, centre, inertia)
    ends: list[tuple[Triple, str, Triple]] = [
        ((-0.106066, 0.021, -0.106066), "upper_arm", (-0.0248764, 0.2195, 1.8743851e-4)),
        ((-0.106066, 0.021, 0.106066), "upper_arm", (-0.0248764, 0.2545, 1.8743851e-4)),
        ((0.106066, 0.021, -0.106066), "upper_arm", (0.025124, 0.2195, 1.8743851e-4)),
        ((0.106066, 0.021, 0.106066), "upper_arm", (0.025124, 0.2545, 1.8743851e-4)),
        ((0.0, 0.021, 0.25), "lower_arm", (0.0, 0.0705005, 0.0249999)),
        ((0.0, 0.021, -0.25), "lower_arm", (0.0, 0.0705005, -0.0250003)),
    ]
    routes, tip = [[("base", start), (link, end)] for start, link, end in ends], (0.0, 0.243, 0.0)
    return arm_of("bm_arm", [upper, lower], tip, routes, minimum=10.0, maximum=80.0)


HEAD = "# An arm of cdsm."  # begins what cdsm writes
BUILDERS = (presets.sjtu_snake, carex, myo_shoulder, bm_arm, presets.simplex)


def files() -> dict[str, str]:
    """Return name and text of every file; a TOML keeps the comment at its head."""
    texts = {}
    for prototype in presets.virtual_prototype_geometry, paper.experimental_prototype_geometry:
        geometry = prototype()
        texts[f"{geometry.name}.toml"] = geometry.to_toml()
        texts[f"{geometry.name}.urdf"] = cdsm.to_urdf(geometry)
    for build in BUILDERS:
        arm, name = build(), build.__name__
        comment = (FOLDER / f"{name}.toml").read_text(encoding="utf-8").split(HEAD)[0]
        with TemporaryDirectory() as folder:
            said = arm.write(Path(folder, "arm.toml")).read_text(encoding="utf-8")
        said = re.sub(r"text = '''.*?'''", f'file = "{name}.urdf"', said, flags=re.DOTALL)
        texts[f"{name}.toml"] = comment + said
        texts[f"{name}.urdf"] = arm.urdf
    return texts


if __name__ == "__main__":
    for name, said in files().items():
        print((FOLDER / name).write_text(said, encoding="utf-8"), name)
