"""Serve the live view: one page for any number of browsers."""

from __future__ import annotations

import json
import math
import os
import socket
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import CdsmError, InvalidInput
from cdsm.manipulator import Manipulator
from cdsm.planning.path import checked_path
from cdsm.support.extras import need
from cdsm.support.validation import flag, instance, one_of, quantity, vector, whole_number
from cdsm.support.values import Array
from cdsm.tension import DEFAULT_SOLVER, installed_solvers
from cdsm.view.live_view import View, quiet
from cdsm.view.state import Setting

if TYPE_CHECKING:
    import viser

    from cdsm.view.guard import Guard

_PANEL = 390  # width of the panel in pixels, so that its longest row fits on one line


def serve(
    arm: Manipulator,
    *,
    host: str = "127.0.0.1",
    port: int = 8080,
    q: ArrayLike | None = None,
    minimum: float = 10.0,
    maximum: float = math.inf,
    force: ArrayLike = (0.0, 0.0, 0.0),
    sag: bool = False,
    angles: ArrayLike | None = None,
    tips: ArrayLike | None = None,
    solver: str = DEFAULT_SOLVER,
    largest_tension: float = 200.0,
    largest_force: float = 20.0,
    arm_arguments: Sequence[str] | None = None,
) -> View:
    """Serve a live view of an arm: sliders, a 3D picture, and the stiffness.

    The view runs in background threads until it is closed. All browsers share one set of sliders.
    Web pages of other sites cannot connect. Other machines can connect only if ``host`` allows it
    (then a warning is logged), and only with the token in the URL.

    Args:
        arm: The arm; it is not changed.
        host: Address to listen at; the default allows this machine only.
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
        arm_arguments: Arguments of the command ``cdsm`` that describe the arm. If given, the page
            shows the command that computes its numbers, otherwise lines of Python.

    Raises:
        MissingExtra: viser is not installed (extra ``[view]``).
        InvalidInput: A value has the wrong type or shape, or the port is not available.
        CdsmError: The installed viser starts its server so that other sites cannot be refused.
        JointLimitError: An angle is beyond its limit.
        UnknownName: The solver is not installed.
    """
    need("view", "viser")
    straight = np.clip(np.zeros(instance("arm", arm, Manipulator).nv), arm.lower, arm.upper)
    path = None if angles is None and tips is None else checked_path(arm, angles, tips)
    route = None if path is None else _tips(arm, path, of_tips=tips is not None)
    start = Setting(
        q=arm._angles(straight if q is None else q, check_limits=True),
        minimum=quantity("minimum", minimum, "tension", zero=True),
        maximum=quantity("maximum", maximum, "tension", infinite=True),
        force=vector("force", force, 3, "force at the tip [N], base axes"),
        sag=flag("sag", sag),
        solver=one_of("installed solver", solver, installed_solvers()),
    )
    tension = quantity("largest_tension", largest_tension, "tension")
    push = max(quantity("largest_force", largest_force, "force"), float(abs(start.force).max()))
    view = View(arm, start, arm_arguments, *_server(host, port, arm.name), (tension, push))
    if path is not None and route is not None:
        view._add_path(path, route)
    return view


def _tips(arm: Manipulator, path: Array, of_tips: bool) -> Array:
    """Return the tip positions (S, 3) [m] along a path.

    ``path`` has these positions if ``of_tips``, else joint angles (S, nv) [rad]. Raises
    InvalidInput if a sample of joint angles is not a posture of the arm.
    """
    if of_tips:
        return path
    tips = []
    for i, q in enumerate(path):
        try:
            tips.append(arm.at(q).tip[:3, 3])
        except CdsmError as error:
            raise InvalidInput("angles", f"sample {i + 1}: {error}") from None
    return np.array(tips)


def _server(host: object, port: object, name: str) -> tuple[Guard, viser.ViserServer]:
    """Start a viser server and its guard; InvalidInput if ``host`` or ``port`` is not available.

    ``name`` is that of the arm, for the title of the page.
    """
    from viser._messages import RunJavascriptMessage

    from cdsm.view.guard import Guard

    if not isinstance(host, str):
        raise InvalidInput("host", f"{host!r} given; an address is needed, such as '127.0.0.1'.")
    port = whole_number("port", port, 0, 65535)
    _check_free(host, port)
    guard = Guard(host)
    with quiet():
        server = guard.start(port)
    # viser's share button opens a tunnel to a public server; the guard refuses it
    server.gui.configure_theme(control_width="large", show_logo=False, show_share_button=False)
    server.gui.main_panel.dock_right()
    server.gui.main_panel.set_width(_PANEL)  # the width of "large" depends on the browser
    # viser has no option for the title
    title = RunJavascriptMessage(f"document.title = {json.dumps(f'{name}: cdsm view')}")
    server.gui._websock_interface.queue_message(title)
    return guard, server


def _check_free(host: str, port: int) -> None:
    """Raise InvalidInput unless ``port`` of ``host`` is free.

    Otherwise, viser would use the next port, or wait for ever.
    """
    try:
        for family, *_, address in socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        ):
            socket.create_server(address, family=family).close()
    except (socket.gaierror, UnicodeError) as error:
        raise InvalidInput("host", f"{host!r} is no address of this machine: {error}.") from None
    except OSError as error:
        raise InvalidInput(
            "port",
            f"{port} on {host} is not available: {os.strerror(error.errno or 0)}. "
            "Give another port, or 0 for any free one.",
        ) from None
