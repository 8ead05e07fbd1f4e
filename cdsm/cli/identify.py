"""``cdsm identify``: find parameters of an arm from loops of weight tests, or plan such tests."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import cdsm
from cdsm.cli.files import Picture
from cdsm.cli.options import ArmOptions, AsJson
from cdsm.cli.output import answer, write_picture
from cdsm.cli.values import misuse

if TYPE_CHECKING:
    from cdsm.parameters import ArmParameters

Range = tuple[float, float]


def identify(
    arm: ArmOptions,
    loops: Annotated[
        Path,
        typer.Argument(
            metavar="LOOPS.csv",
            help="A line per reading. Columns: test; joints in deg, such as joint1_1 [deg]; "
            "direction (an axis such as -z); force [N]; displacement [mm] along it, or x [mm], "
            "y [mm], z [mm]; and minimum [N] or the tension of each cable, such as cable1_1 [N].",
        ),
    ],
    free: Annotated[
        list[str],
        typer.Option(
            metavar="NAME[@JOINT][=LOW:HIGH]",
            help="Parameter to find; repeat it. friction; rigidity (a factor on the EA of the "
            "wires); spring [N/mm] in series; lead, hole_radius, disk_offset, link_length [mm]; "
            "link_mass [g]. Of all joints, or of one. Without bounds: from half to twice the "
            "arm's own value; friction from 0 to 1.",
        ),
    ],
    reading_std: Annotated[float, typer.Option(help="Standard deviation of a reading [mm].")],
    min_tension: Annotated[
        float | None,
        typer.Option(help="Lower bound of all tensions [N], if LOOPS.csv has no tensions."),
    ] = None,
    plan: Annotated[
        int | None,
        typer.Option(
            metavar="TESTS",
            help="Do not identify, but plan so many tests. Those of LOOPS.csv are the candidates; "
            "readings are not needed.",
            min=1,
        ),
    ] = None,
    figure: Picture = None,
    as_json: AsJson = False,
) -> None:
    """Find friction, rigidity, springs and dimensions from loops of weight tests.

    A test applies a force along a direction and removes it, with locked motors. Friction widens the
    loop of force and displacement. The answer gives each parameter with a 95 % interval, and warns
    of parameters that the tests do not determine.
    """
    from cdsm.identification.experiment_plan import plan_tests
    from cdsm.parameters import ArmParameters
    from cdsm.support.format import aligned, plain

    described = arm.read()
    ranges = _ranges(free)
    parameters = ArmParameters(described, tuple(ranges))
    read = cdsm.read_loops(
        loops, described, displacement_std=1e-3 * reading_std, minimum=min_tension
    )
    shown = _Shown(parameters)
    if plan is not None:
        planned = plan_tests(shown.arm_of, shown.present, read, tests=plan)
        write_picture(figure, planned.plot)
        answer(as_json, planned.to_dict, planned)
        return
    bounds = {shown.label(name): shown.bounds(name, given) for name, given in ranges.items()}
    start = shown.present
    inside = all(low <= start[label] <= high for label, (low, high) in bounds.items())
    found = cdsm.identify(shown.arm_of, read, bounds, start=start if inside else None)
    intervals = found.confidence()
    write_picture(figure, found.plot)
    warnings = [f"warning: {sentence}" for sentence in found.warnings]
    rows = [("95 % by the profile of χ²", "from", "to")]
    rows += [(name, f"{low:.4g}", f"{high:.4g}") for name, (low, high) in intervals.items()]

    def as_dict() -> dict[str, object]:
        return found.to_dict() | plain({"interval_95": intervals})

    answer(as_json, as_dict, found, "\n".join(aligned(rows)), warnings=warnings)


def _ranges(free: list[str]) -> dict[str, Range | None]:
    """Return the bounds of each parameter in ``--free``, by name, in the units of the option.

    A parameter without bounds has None.
    """
    ranges: dict[str, Range | None] = {}
    for each in free:
        name, _, given = each.partition("=")
        if name in ranges:
            raise misuse("--free", f"{name} is given twice.")
        ranges[name] = None
        if given:
            low, _, high = given.partition(":")
            try:
                ranges[name] = float(low), float(high)
            except ValueError:
                raise misuse(
                    "--free", f"{each!r} given; give NAME=LOW:HIGH, such as friction=0:0.5."
                ) from None
    return ranges


class _Shown:
    """Parameters of an arm in printed units (mm, N/mm, g), by labels such as ``lead [mm]``."""

    def __init__(self, parameters: ArmParameters) -> None:
        self._parameters = parameters
        self._names = {self.label(name): name for name in parameters.names}

    def label(self, name: str) -> str:
        unit, _ = self._parameters.unit(name)
        return f"{name} [{unit}]" if unit else name

    def arm_of(self, **values: float) -> cdsm.Manipulator:
        return self._parameters(
            **{
                (name := self._names[label]): value * self._parameters.unit(name)[1]
                for label, value in values.items()
            }
        )

    @property
    def present(self) -> dict[str, float]:
        return {
            self.label(name): value / self._parameters.unit(name)[1]
            for name, value in self._parameters.present.items()
        }

    def bounds(self, name: str, given: Range | None) -> Range:
        """Return the bounds ``given``, or defaults if they are None.

        Defaults are 0 to 1 for friction, else half to twice the value of the arm.
        """
        if given is not None:
            return given
        if name.partition("@")[0] == "friction":
            return 0.0, 1.0
        value = self.present[self.label(name)]
        if not 0.0 < value < math.inf:
            raise misuse("--free", f"the arm has {name} {value:g}; give bounds, {name}=LOW:HIGH.")
        return value / 2.0, 2.0 * value
