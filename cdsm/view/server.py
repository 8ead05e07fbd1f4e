"""Serve the live view: one page for any number of browsers of this machine."""

from __future__ import annotations

import contextlib
import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import CdsmError, InvalidInput, need
from cdsm.manipulator import Manipulator
from cdsm.planning.path import checked_path
from cdsm.support.validation import flag, instance, one_of, quantity, vector, whole_number
from cdsm.support.values import Array
from cdsm.tension import DEFAULT_SOLVER, installed_solvers
from cdsm.view.state import Setting

if TYPE_CHECKING:
    from cdsm.view.live_view import View

_PANEL = 390  # width of the panel in pixels, so that its longest row fits on one line


def serve(
    arm: Manipulator,
    *,
    host: str = "127.0.0.1",
    port: int = 8080,
    q: ArrayLike | None = None,
    minimum: float = 0.0,
    maximum: float = math.inf,
    force: ArrayLike = (0.0, 0.0, 0.0),
    sag: bool = False,
    angles: ArrayLike | None = None,
    tips: ArrayLike | None = None,
    solver: str = DEFAULT_SOLVER,
    largest_tension: float = 200.0,
    largest_force: float = 20.0,
) -> View:
    """Serve a live view of an arm: sliders, a 3D picture, and the stiffness.

    The view runs in background threads until it is closed. All browsers share one set of sliders.
    Only this machine can connect, and no web page of another site. To see the view from another
    machine, forward the port: ``ssh -L 8080:localhost:8080 THIS_MACHINE``.

    An arm with springs and fewer cables than joints has sliders of how much wire each motor takes
    in, from straight cables, and :func:`~cdsm.forward_statics` gives its posture; with ``q`` or a
    path it has those of the joints.

    Args:
        arm: The arm; it is not changed.
        host: Address to listen at, of this machine only: a loopback address or ``"localhost"``.
        port: Port to listen at; 0 for any free port.
        q: Joint angles at the start (nv,) [rad]; by default zero, or the nearest joint limit.
        minimum: Lower bound of all tensions at the start [N].
        maximum: Upper bound of all tensions [N].
        force: Force at the tip at the start, in base axes (3,) [N].
        sag: Whether the force first moves the arm to its :func:`~cdsm.equilibrium`. Otherwise the
            tensions balance the force at the posture.
        angles: A path to play, as joint angles (S, nv) [rad]; the arm starts at the first.
        tips: A path to play, as tip positions (S, 3) [m]; give only one kind of path.
        solver: Solver of :func:`~cdsm.distribute_tension`.
        largest_tension: Right end of the slider of the lower bound [N]; larger if ``minimum`` is.
        largest_force: Each force slider goes from − to + this value [N]; larger if ``force`` is.

    Returns:
        The running view. ``url`` is the address of its page, ``shown`` its present results;
        ``wait()`` waits for Ctrl-C, ``close()`` or the end of a ``with`` block ends it.

    Raises:
        CdsmError: viser is not installed (extra ``[view]``). The installed viser starts its server
            so that other sites cannot be refused.
        InvalidInput: A value has the wrong type or shape, an angle is beyond its limit, the solver
            is not installed, or host or port is not available.
    """
    need("view", "viser")
    from cdsm.view.guard import guarded_server
    from cdsm.view.live_view import View

    straight = np.clip(np.zeros(instance("arm", arm, Manipulator).nv), arm.lower, arm.upper)
    free = q is None and angles is None and tips is None
    pulled = free and arm.has_springs and len(arm.cables) < arm.nv
    path = None if angles is None and tips is None else checked_path(arm, angles, tips)
    route = path if path is None or tips is not None else _tips(arm, path)
    start = Setting(
        q=arm._angles(straight if q is None else q, check_limits=True),
        minimum=quantity("minimum", minimum, "tension", zero=True),
        maximum=quantity("maximum", maximum, "tension", infinite=True),
        force=vector("force", force, 3, "force at the tip [N], base axes"),
        sag=flag("sag", sag),
        solver=one_of("installed solver", solver, installed_solvers()),
        pull=np.zeros(len(arm.cables)) if pulled else None,
    )
    pull = max(quantity("largest_tension", largest_tension, "tension"), start.minimum)
    push = max(quantity("largest_force", largest_force, "force"), float(abs(start.force).max()))
    with contextlib.redirect_stdout(None):  # viser prints addresses
        server = guarded_server(host, whole_number("port", port, 0, 65535), arm.name)
    try:
        # viser's share button opens a tunnel to a public server; the guard refuses it
        server.gui.configure_theme(show_logo=False, show_share_button=False)
        server.gui.main_panel.dock_right()
        server.gui.main_panel.set_width(_PANEL)
        view = View(arm, start, server, pull, push)
        if path is not None and route is not None:
            view.add_path(path, route)
    except BaseException:
        server.stop()
        raise
    return view


def _tips(arm: Manipulator, path: Array) -> Array:
    """Return the tip positions (S, 3) [m] at joint angles (S, nv); name a sample that has none."""
    tips = []
    for i, q in enumerate(path):
        try:
            tips.append(arm.at(q).tip[:3, 3])
        except CdsmError as error:
            raise InvalidInput("angles", f"sample {i + 1}: {error}") from None
    return np.array(tips)
