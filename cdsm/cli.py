"""The command line. mm, degrees and N/mm exist here; plotting is imported when it is needed."""

from __future__ import annotations

import io
import json
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.progress import track
from rich.table import Table

import cdsm

if TYPE_CHECKING:
    from cdsm._checks import Array
    from cdsm.stiffness import Stiffness
    from cdsm.tension import Tension

app = typer.Typer(
    name="cdsm",
    help="Stiffness of cable-driven serpentine manipulators.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
_errors = Console(stderr=True)

_WIDE = 110
"""Columns from which the table of claims is legible; below, each claim is a few lines."""


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"cdsm {cdsm.__version__}")
        raise typer.Exit


@app.callback()
def main(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_version, is_eager=True, help="Show it and exit."),
    ] = False,
) -> None:
    """Stiffness of cable-driven serpentine manipulators."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a terminal without Greek shows "?" for it
            stream.reconfigure(errors="replace")


GeometryFile = Annotated[Path, typer.Argument(metavar="GEOMETRY.toml", help="Geometry to read.")]


@app.command()
def reproduce(
    out: Annotated[Path, typer.Option(help="Folder for the figures and tables.")] = Path(
        "reproduction"
    ),
) -> None:
    """Recompute Figs. 3 to 13 of the paper: pictures, table and numbers."""
    with _reported():
        from cdsm import paper, plots
        from cdsm._files import make_folder, write_file, write_text

        make_folder(out)
        results, written = [], []
        for compute in track(paper.FIGURES.values(), "recomputing the paper", console=_errors):
            result = compute()
            results.append(result)
            picture = plots.plot_paper(result)
            written.append(write_file(out / f"{result.name}.png", picture.savefig))
        written.append(write_text(out / "reproduction.md", paper.to_markdown(results)))
        numbers = json.dumps(paper.to_dict(results), indent=1, allow_nan=False)
        written.append(write_text(out / "reproduction.json", numbers + "\n"))
        _show(paper.HEADER, paper.to_rows(results))
        typer.echo(paper.EXPLANATION)
        typer.echo("written: " + ", ".join(map(str, written)))


@app.command()
def urdf(
    geometry: GeometryFile,
    output: Annotated[Path, typer.Option("--output", "-o", help="URDF file to write.")],
) -> None:
    """Write the URDF of an arm, checked by reading it back with two parsers."""
    with _reported():
        from cdsm.geometry import Geometry
        from cdsm.urdf import write_urdf

        arm = Geometry.read(geometry)
        path = write_urdf(arm, output)
        typer.echo(f"{arm}\nwritten: {path}")


@app.command()
def stiffness(
    geometry: GeometryFile,
    angles: Annotated[
        str,
        typer.Option(
            help="Joint angles in degrees, separated by commas; or one for all joints.",
            metavar="DEG,DEG,...",
        ),
    ] = "0",
    min_tension: Annotated[float, typer.Option(help="Lower bound of all tensions [N].")] = 10.0,
    max_tension: Annotated[float, typer.Option(help="Upper bound of all tensions [N].")] = float(
        "inf"
    ),
    rigidity: Annotated[
        float | None,
        typer.Option(help="Constant EA of all cables [N]; default: the 1x19 strand of Eq. 19."),
    ] = None,
    wrench: Annotated[
        str, typer.Option(help="At the tip: FX,FY,FZ,MX,MY,MZ [N, N m].", metavar="FX,...,MZ")
    ] = "0,0,0,0,0,0",
    gravity: Annotated[
        str, typer.Option(help="In base axes: GX,GY,GZ [m/s²].", metavar="GX,GY,GZ")
    ] = "0,0,-9.81",
    solver: Annotated[str, typer.Option(help="Quadratic-programming solver.")] = "daqp",
    as_json: Annotated[bool, typer.Option("--json", help="Print SI numbers as JSON.")] = False,
) -> None:
    """Distribute the tensions at a posture, and print them and the stiffness."""
    with _reported():
        import numpy as np

        from cdsm.elasticity import LinearElasticity
        from cdsm.geometry import Geometry
        from cdsm.manipulator import Manipulator
        from cdsm.presets import STRAND_1X19
        from cdsm.stiffness import stiffness as evaluate
        from cdsm.tension import distribute_tension

        law = STRAND_1X19 if rigidity is None else LinearElasticity(rigidity)
        arm = Manipulator(Geometry.read(geometry), law, gravity=_numbers("--gravity", gravity))
        degrees = _numbers("--angles", angles)
        degrees = degrees * arm.nv if len(degrees) == 1 else degrees
        if len(degrees) != arm.nv:
            names = ", ".join(arm.joint_names)
            raise typer.BadParameter(
                f"{len(degrees)} given; give one angle, or one for each of {names}.",
                param_hint="--angles",
            )
        pose = arm.at(np.deg2rad(degrees))
        pull = distribute_tension(
            pose, min_tension, max_tension, _numbers("--wrench", wrench), solver
        )
        K = evaluate(pose, pull)
        if as_json:
            typer.echo(json.dumps(_to_dict(pull, K), indent=1, allow_nan=False))
        else:
            typer.echo(f"{arm.geometry}\n\n{pull}\n\n{K}")


@app.command()
def fit(
    test: Annotated[Path, typer.Argument(metavar="TEST.csv", help="Tensile test to read.")],
    gauge_length: Annotated[
        float | None,
        typer.Option(help="Length of the tested wire [mm]; default: what the file says."),
    ] = None,
    method: Annotated[str, typer.Option(help="monotone, or polynomial as in the paper.")] = (
        "monotone"
    ),
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Elasticity to write, as TOML.")
    ] = None,
    figure: Annotated[Path | None, typer.Option(help="Picture to write, as PNG.")] = None,
) -> None:
    """Fit the rigidity of a wire to its tensile test: report, and if wanted figure and TOML."""
    with _reported():
        from cdsm._files import write_file
        from cdsm.tensile import fit_tensile_test
        from cdsm.tensile_data import read_tensile_csv
        from cdsm.wire_file import write_elasticity

        length = None if gauge_length is None else gauge_length / 1000.0
        data = read_tensile_csv(test, gauge_length=length)
        with _errors.status("fitting, with 200 bootstrap samples"):
            found = fit_tensile_test(data.displacement, data.force, data.gauge_length, method)
        typer.echo(str(found))
        if out is not None:
            typer.echo(f"written: {write_elasticity(found.elasticity, out)}")
        if figure is not None:
            typer.echo(f"written: {write_file(figure, found.plot().savefig)}")


def _show(header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """A table where there is room for one, else a few lines for each row."""
    console = Console()
    if console.width >= _WIDE:
        table = Table(*header)
        for row in rows:
            table.add_row(*row)
        console.print(table)
        return
    for figure, quantity, *cells in rows:
        typer.echo(f"{figure}: {quantity}")
        for name, cell in zip(header[2:], cells, strict=True):
            typer.echo(f"    {name:<12} {cell}")


@contextmanager
def _reported() -> Iterator[None]:
    """Turn a CdsmError into one message and exit code 1, without a traceback."""
    from cdsm.errors import CdsmError

    try:
        yield
    except (CdsmError, OSError) as error:  # OSError: the terminal or pipe itself
        _errors.print(f"error: {error}", style="red", markup=False, highlight=False, soft_wrap=True)
        raise typer.Exit(1) from None


def _numbers(option: str, text: str) -> list[float]:
    """Numbers separated by commas or spaces."""
    try:
        return [float(word) for word in text.replace(",", " ").split()]
    except ValueError as error:
        raise typer.BadParameter(
            f"{error}; separate numbers by commas.", param_hint=option
        ) from None


def _to_dict(pull: Tension, K: Stiffness) -> dict[str, object]:
    """Everything the table shows, in SI units; null where a stiffness is infinite."""
    import numpy as np

    from cdsm.errors import SingularStiffness

    def matrix(read: Callable[[], Array]) -> list[list[float]] | None:
        try:
            values: list[list[float]] = read().tolist()
        except SingularStiffness:
            return None
        return values

    pose = pull.posture
    along = [K.along(axis) for axis in np.eye(3)]
    return {
        "angles_rad": dict(zip(pose.arm.joint_names, pose.q.tolist(), strict=True)),
        "tip_position_m": pose.tip[:3, 3].tolist(),
        "tension_N": {
            cable.name: value
            for cable, value in zip(pose.arm.cables, pull.values.tolist(), strict=True)
        },
        "cable_length_m": pose.cable_lengths.tolist(),
        "static_residual_Nm": K.residual.tolist(),
        "along_N_per_m": [value if np.isfinite(value) else None for value in along],
        "cartesian_N_per_m": matrix(lambda: K.cartesian),
        "pseudoinverse_N_per_m": matrix(K.pseudoinverse),
        "compliance": matrix(lambda: K.compliance),
        "joint_stiffness_Nm_per_rad": K.joint.tolist(),
        "margin_Nm_per_rad": K.margin,
        "stable": K.is_stable,
    }
