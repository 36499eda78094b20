"""Loops that are judged together: of one signal on one rig, their controllers by different names."""

from collections.abc import Sequence
from dataclasses import replace

from ..base.errors import InputError
from ..control.controller_spec import ControllerSpec
from .closed_loop import ClosedLoop


def loops_of_one_rig(loops: ClosedLoop | Sequence[ClosedLoop], where: str) -> list[ClosedLoop]:
    """The loops as a list. Raises InputError, opened by `where`, for none, and for loops of two rigs or signals."""
    listed = [loops] if isinstance(loops, ClosedLoop) else list(loops) if isinstance(loops, Sequence) else []
    if not listed or not all(isinstance(loop, ClosedLoop) for loop in listed):
        raise InputError(f"{where}: give a list of ClosedLoops")
    first = listed[0]
    for loop in listed[1:]:
        if (loop.signal, loop.rig, loop.ideal) != (first.signal, first.rig, first.ideal):
            raise InputError(
                f"{where}: {loop.controller.name} is on another rig or signal than {first.controller.name}, or only "
                "one of them is ideal; compare loops of one signal on one rig"
            )
    return listed


def named_controllers(loops: Sequence[ClosedLoop]) -> tuple[ControllerSpec, ...]:
    """The controllers; one whose name is taken gets a number."""
    controllers: dict[str, ControllerSpec] = {}
    for controller in (loop.controller for loop in loops):
        name, count = controller.name, 1
        while name in controllers:
            count += 1
            name = f"{controller.name}-{count}"
        controllers[name] = replace(controller, name=name)
    return tuple(controllers.values())
