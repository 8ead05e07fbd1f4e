"""Drawings of the site: arms from their geometry, with the names of their sizes."""

import warnings
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

import cdsm
from cdsm.plots.style import BLUE, MM, VERMILLION

GRAY = "0.35"
TEXT, SMALL = 8.0, 7.0


def flat_arm(friction: float = 0.0) -> cdsm.Manipulator:
    """Build an arm that bends in one plane, so that a drawing shows it whole."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", cdsm.CdsmWarning)  # its cables share holes: fewer lines
        geometry = cdsm.Geometry.hinged(
            joints=3,
            twist=0.0,
            link_length=0.06,
            base_length=0.04,
            disk_offset=0.012,
            hole_radius=0.022,
            link_mass=0.1,
            lead=0.05,
            friction=friction,
        )
    return cdsm.Manipulator(geometry, cdsm.presets.STRAND_1X19)


def side_view(axes: Any, pose: cdsm.Posture) -> None:
    """Draw an arm that bends in one plane from its side: links, disks, cables, actuators."""
    geometry = pose.arm.geometry
    for bone in pose.bones:
        axes.plot(MM * bone[:, 0], MM * bone[:, 2], color="0.1", linewidth=2.5, zorder=3)
    for disk in geometry.disks:
        placed = pose.link_pose(disk.link)
        ends = placed[:3, 3] + np.outer([disk.x, disk.x], placed[:3, 0])
        ends += np.outer([-disk.radius, disk.radius], placed[:3, 2])
        axes.plot(MM * ends[:, 0], MM * ends[:, 2], color=GRAY, linewidth=3.0, zorder=2)
    for path, cable in zip(pose.cable_paths, pose.arm.cables, strict=True):
        x, z = MM * path[:, 0], MM * path[:, 2]
        axes.plot(x, z, color=BLUE, linewidth=1.0)
        axes.plot([x[0] - MM * cable.lead, x[0]], z[[0, 0]], "--", color=BLUE, linewidth=1.0)
        axes.plot(x[0] - MM * cable.lead, z[0], "s", color=BLUE, markersize=7)
    joints = MM * pose.joint_positions
    axes.plot(joints[:, 0], joints[:, 2], "o", color="0.1", markerfacecolor="white", zorder=4)
    axes.set_aspect("equal")
    axes.axis("off")


def dimension(axes: Any, start: Any, end: Any, text: str, offset: tuple[float, float]) -> None:
    """Draw a size between two points [mm], and its name beside the middle, off by points."""
    axes.annotate(
        "", end, start, arrowprops={"arrowstyle": "<->", "color": VERMILLION, "linewidth": 1.0}
    )
    middle = (np.asarray(start) + np.asarray(end)) / 2.0
    axes.annotate(
        text, middle, offset, textcoords="offset points", color=VERMILLION, fontsize=TEXT,
        ha="center", va="center",
    )  # fmt: skip


def named_sizes(axes: Any, pose: cdsm.Posture) -> None:
    """Name lead, L_0, h, R, the joint angle and the tip in a side view."""
    geometry = pose.arm.geometry
    R, h = MM * geometry.hole_radius, MM * geometry.joints[0].disk_offset
    L0, lead = MM * geometry.base_length, MM * geometry.cables[0].lead
    low, high = -1.75 * R, 1.3 * R
    dimension(axes, (0.0, low), (L0, low), "base length $L_0$", (0, -8))
    dimension(axes, (L0 - h - lead, -1.25 * R), (L0 - h, -1.25 * R), "lead", (-24, -8))
    dimension(axes, (L0 - h, high), (L0, high), "$h$", (0, 7))
    dimension(axes, (L0 - h - 2, 0.0), (L0 - h - 2, R), "$R$", (-9, 0))
    lines = ((0.0, 0.0, low), (L0, high, low), (L0 - h - lead, -R, low / 1.4))
    for x, start, end in lines:
        axes.plot([x, x], [start, end], ":", color=VERMILLION, linewidth=0.7)
    axes.plot([L0 - h, L0 - h], [R, high], ":", color=VERMILLION, linewidth=0.7)
    joint, tip = MM * pose.joint_positions[1], MM * pose.tip[:3, 3]
    axes.annotate("joint angle $q_2$", joint[[0, 2]], (20, 42), textcoords="offset points",
                  fontsize=TEXT, arrowprops={"arrowstyle": "-", "color": GRAY})  # fmt: skip
    axes.annotate("tip (tool0)", tip[[0, 2]], (-6, -26), textcoords="offset points",
                  fontsize=TEXT, arrowprops={"arrowstyle": "-", "color": GRAY})  # fmt: skip
    axes.annotate("actuators", (L0 - h - lead, R), (0, 11), textcoords="offset points",
                  fontsize=TEXT, color=BLUE, ha="center")  # fmt: skip
    axes.set_ylim(top=high + 6.0)


def end_view(axes: Any, geometry: cdsm.Geometry, joint: int = 1) -> None:
    """Draw a disk from its front, with R, and φ of the first cable of a joint."""
    R, disk = MM * geometry.hole_radii[joint - 1], MM * geometry.disks[0].radius
    turn = np.linspace(0.0, 2.0 * np.pi, 181)
    axes.plot(disk * np.cos(turn), disk * np.sin(turn), color=GRAY, linewidth=2.0)
    for cable in geometry.cables:
        place = R * np.cos(cable.angle), R * np.sin(cable.angle)
        own = cable.joint == joint
        axes.plot(*place, "o", color=BLUE if own else GRAY, markersize=6 if own else 3)
    angle = next(c.angle for c in geometry.cables if c.joint == joint and c.angle % (2 * np.pi) > 0)
    axes.plot([0, R], [0, 0], color="0.1", linewidth=0.8)
    axes.plot([0, R * np.cos(angle)], [0, R * np.sin(angle)], color=VERMILLION, linewidth=1.0)
    arc = np.linspace(0.0, angle, 60)
    axes.plot(0.35 * R * np.cos(arc), 0.35 * R * np.sin(arc), color=VERMILLION, linewidth=1.0)
    half = angle / 2.0
    axes.text(0.5 * R * np.cos(half), 0.5 * R * np.sin(half), r"$\varphi$", color=VERMILLION,
              fontsize=TEXT + 1, ha="center", va="center")  # fmt: skip
    axes.text(0.62 * R * np.cos(angle) - 4, 0.62 * R * np.sin(angle), "$R$", color=VERMILLION,
              fontsize=TEXT, ha="right")  # fmt: skip
    axes.text(R + 3, -1.0, "y", fontsize=TEXT)
    axes.plot([0, 0], [0, R], color="0.1", linewidth=0.8)
    axes.text(1.0, R * 0.86, "z", fontsize=TEXT)
    axes.set_title("a disk, seen from the tip", fontsize=SMALL + 1)
    axes.set_aspect("equal")
    axes.axis("off")


def labelled_arm() -> Any:
    """Draw an arm from its side and a disk from its front, with the names of all sizes."""
    arm = flat_arm()
    pose = arm.at(np.deg2rad([12, 18, 18]))
    round_arm = cdsm.Geometry.universal(
        joints=3, cables_per_joint=3, link_length=0.06, base_length=0.04, disk_offset=0.012,
        hole_radius=0.022, link_mass=0.1,
    )  # fmt: skip
    figure, (left, right) = plt.subplots(
        1, 2, figsize=(8.0, 3.2), width_ratios=(3.3, 1.0), layout="constrained", dpi=110
    )
    side_view(left, pose)
    named_sizes(left, pose)
    end_view(right, round_arm, joint=2)
    return figure


def readings() -> tuple[Any, dict[str, float]]:
    """Draw what the arm does in each reading of "the stiffness along z", and return them [N/m].

    In each panel the tip moves up by the same way. Its joints move as the force alone moves them,
    as they do with the tip held sideways, and by the least joint motion that does it.
    """
    arm = flat_arm()
    pose = arm.at(np.deg2rad([12, 18, 18]))
    K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, minimum=50.0))
    J, way = pose.jacobian[[0, 2]], 0.012
    pushed = np.linalg.solve(K.joint, J.T)
    motions = {
        "along: free to move": pushed[:, 1] / (J[1] @ pushed[:, 1]),
        "cartesian: held in x": pushed @ np.linalg.inv(J @ pushed)[:, 1],
        "pseudoinverse: least $|\\delta q|$": np.linalg.pinv(J)[:, 1],
    }
    figure, panels = plt.subplots(1, 3, figsize=(8.0, 2.5), layout="constrained", dpi=110)
    found = {}
    for axes, (name, motion) in zip(panels, motions.items(), strict=True):
        found[name.split(":")[0]] = motion @ K.joint @ motion
        side_view(axes, pose)
        moved = arm.at(pose.q + way * motion, check_limits=False)
        for bone in moved.bones:
            axes.plot(MM * bone[:, 0], MM * bone[:, 2], color=VERMILLION, linewidth=2.0, zorder=5)
        start, end = (MM * each.tip[[0, 2], 3] for each in (pose, moved))
        axes.annotate("", end, start, arrowprops={"arrowstyle": "->", "color": VERMILLION})
        axes.set_title(f"{name}\n{found[name.split(':')[0]] / 1e3:.3g} N/mm", fontsize=TEXT)
    return figure, found


def contributions() -> Any:
    """Draw what the terms of K_θ contribute to the stiffness along z, over the least tension.

    Once for cables of strand alone, once with a soft spring in series with each cable, up to 90 %
    of the tension at which this arm buckles.
    """
    strand = flat_arm()
    wire = cdsm.presets.STRAND_1X19
    springs = cdsm.serpentine_cables(strand.geometry, wire, series_stiffness=6e3)
    figure, panels = plt.subplots(1, 2, figsize=(8.0, 3.0), layout="constrained", dpi=110)
    for axes, arm, title in (
        (panels[0], strand, "strand"),
        (panels[1], strand.with_cables(springs), "strand and a spring of 6 N/mm"),
    ):
        pose = arm.at(np.deg2rad([12, 18, 18]))
        least = np.linspace(10.0, 0.9 * min(170.0, cdsm.critical_tension(pose).minimum), 30)
        tensions = [cdsm.distribute_tension(pose, minimum=F) for F in least]
        shares = [cdsm.stiffness(pose, each).shares("z") for each in tensions]
        terms = {
            "sum": [each.total for each in shares],
            "passive": [each.passive.sum() for each in shares],
            "active": [each.active.sum() for each in shares],
            "gravity": [each.gravity for each in shares],
        }
        for name, values in terms.items():
            width = 2.5 if name == "sum" else 1.3
            axes.plot(least, np.array(values) / 1e3, label=name, linewidth=width)
        axes.axhline(0.0, color="0.3", linewidth=0.6)
        axes.set_title(title, fontsize=TEXT)
        axes.set(xlabel="least tension [N]")
        axes.grid(alpha=0.3)
    panels[0].set(ylabel="part of the stiffness along z [N/mm]")
    panels[0].legend(fontsize=SMALL)
    return figure


def hole() -> Any:
    """Draw a cable that turns in the hole of a disk, with its two tensions and the wrap angle."""
    axes: Any
    figure, axes = plt.subplots(figsize=(4.0, 2.2), layout="constrained", dpi=110)
    turn = np.deg2rad(28.0)
    left = np.array([-1.6, 0.0])
    right = 1.6 * np.array([np.cos(turn), -np.sin(turn)])
    axes.plot([left[0], 0, right[0]], [left[1], 0, right[1]], color=BLUE, linewidth=2.5)
    axes.plot([0, 1.6], [0, 0], ":", color=GRAY, linewidth=1.0)
    tilt = turn / 2.0
    for side in (-1.0, 1.0):
        start = side * 0.09 * np.array([np.sin(tilt), np.cos(tilt)])
        axes.plot([start[0], start[0] * 9], [start[1], start[1] * 9], color=GRAY, linewidth=7.0)
    arc = np.linspace(0.0, -turn, 40)
    axes.plot(np.cos(arc), np.sin(arc), color=VERMILLION, linewidth=1.0)
    axes.text(1.1, -0.25, "wrap angle $\\varphi$", color=VERMILLION, fontsize=TEXT)
    for place, text in ((left, "$T_j$"), (right, "$T_{j+1}$")):
        axes.annotate("", 1.25 * place, place, arrowprops={"arrowstyle": "->", "color": BLUE})
        axes.text(*(1.25 * place + [0.0, 0.14]), text, color=BLUE, fontsize=TEXT + 1, ha="center")
    axes.text(0.3, 0.62, "disk", color=GRAY, fontsize=TEXT)
    axes.set_aspect("equal")
    axes.axis("off")
    return figure


def weights(friction: float = 0.1) -> Any:
    """Draw the weight over the displacement of its tip, over the weight, with friction."""
    pose = flat_arm(friction).at(np.deg2rad([12, 18, 18]))
    tension = cdsm.distribute_tension(pose, minimum=50.0)
    forces = np.geomspace(0.05, 8.0, 20)
    wrenches = np.zeros((len(forces), 6))
    wrenches[:, 2] = forces
    history = cdsm.load_cycle(pose, tension, wrenches)
    figure, axes = plt.subplots(figsize=(5.5, 3.0), layout="constrained", dpi=110)
    axes.semilogx(forces, forces / history.displacement[:, 2] / 1e3, label="measured")
    for name, value, style in (
        ("stuck", cdsm.stuck_stiffness(pose, tension).along("z"), ":"),
        ("frictionless", cdsm.stiffness(pose, tension).along("z"), "--"),
    ):
        axes.axhline(value / 1e3, color="0.3", linestyle=style, label=name)
    axes.set(xlabel="weight [N]", ylabel="weight over displacement [N/mm]", ylim=(0, None))
    ticks = [0.05, 0.1, 0.2, 0.5, 1, 2, 5]
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.minorticks_off()
    axes.grid(alpha=0.3)
    axes.legend(fontsize=SMALL)
    return figure
