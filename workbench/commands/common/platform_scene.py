"""A platform drawn: as lines in space, base, legs and platform, pose after pose; and its pose over time."""

from collections.abc import Collection, Mapping

import numpy as np

from ...base.signals import output_signal
from ...report import Label, Line, Panel, Scene
from ...rigs.platform import AXES, LEGS, Platform
from ...rigs.platform.kinematics import arms
from .time_figure import signal_panel

_BASE, _LEG, _ROD, _TOP, _GHOST = "#8c959f", "#0072b2", "#56b4e9", "#d55e00", "#d0d7de"
MARK, _PLAIN, _PLATFORM = "#d55e00", "#8c959f", "#424a53"  # of a drawing in which some legs are marked
_APART = 1.09  # of a base joint's distance from the middle: where its leg's number stands
_SPLIT = 0.45  # of a leg from its base joint: where the cylinder ends


def platform_scene(
    title: str,
    platform: Platform,
    takes: Mapping[str, np.ndarray],
    step: float,
    note: str,
    still: int | None = None,
    marked: Collection[int] | None = None,
) -> Scene:
    """The platform in poses [k, 6] by the name of a take, `step` seconds from one to the next.

    Where nothing runs each take stands `still` at that pose, or where the first take goes furthest. `marked` are legs,
    counted from 0, that stand out; the others are then drawn in grey.
    """
    if still is None:
        still = int(np.argmax(np.abs(next(iter(takes.values()))).max(axis=1)))
    lines = {name: _lines(platform, poses, marked) for name, poses in takes.items()}
    return Scene(title, lines, step, note, still, _labels(platform, marked))


def pose_panels(courses: Mapping[str, tuple[str, np.ndarray, np.ndarray]]) -> list[Panel]:
    """Courses (axis, times [n] s, values [n] SI) by name: a panel of displacements and one of turns, where there are
    any."""
    panels = []
    for axes in (AXES[:3], AXES[3:]):
        own = {name: (t, values) for name, (axis, t, values) in courses.items() if axis in axes}
        panels += [signal_panel(output_signal(axes[0]), own, "pose")] if own else []
    return panels


def _lines(platform: Platform, poses: np.ndarray, marked: Collection[int] | None) -> tuple[Line, ...]:
    """Base, platform at home, legs and platform in poses [k, 6]."""
    geometry, frames = platform.geometry, len(poses)
    top = poses[:, None, :3] + np.array([0.0, 0.0, geometry.height]) + arms(geometry, poses)
    home = geometry.joints + np.array([0.0, 0.0, geometry.height])
    ring, below = (_around(points) for points in (geometry.joints, geometry.base))

    def still(points: np.ndarray) -> np.ndarray:
        return np.broadcast_to(points, (frames, *points.shape))

    looks = [_look(i, marked) for i in range(LEGS)]
    legs = [
        Line(np.stack((still(geometry.base[i]), top[:, i]), axis=1), colour, width)
        for i, (colour, _, width) in enumerate(looks)
    ]
    rods = [
        Line(np.stack((top[:, i] * _SPLIT + geometry.base[i] * (1 - _SPLIT), top[:, i]), axis=1), colour, 2.0)
        for i, (_, colour, _) in enumerate(looks)
    ]
    return (
        Line(still(geometry.base[below]), _BASE, 2.0),
        Line(still(home[ring]), _GHOST, 1.5),
        *legs,
        *rods,
        Line(top[:, ring], _TOP if marked is None else _PLATFORM, 3.0),
    )


def _labels(platform: Platform, marked: Collection[int] | None) -> tuple[Label, ...]:
    """The number of each leg, beside its joint on the base."""
    colours = [_PLATFORM if marked is None or i not in marked else MARK for i in range(LEGS)]
    base = platform.geometry.base
    middle = base.mean(axis=0)
    places = middle + _APART * (base - middle)
    return tuple(Label(str(i + 1), places[i], colour) for i, colour in enumerate(colours))


def _look(leg: int, marked: Collection[int] | None) -> tuple[str, str, float]:
    """Colours of a leg's cylinder and rod, and its width in pixels."""
    if marked is None:
        return _LEG, _ROD, 4.0
    return (MARK, MARK, 7.0) if leg in marked else (_PLAIN, _GHOST, 4.0)


def _around(points: np.ndarray) -> list[int]:
    """The joints [6, 3] in turn about the vertical, the first once more at the end."""
    order = np.argsort(np.arctan2(points[:, 1], points[:, 0])).tolist()
    return [*order, order[0]]
