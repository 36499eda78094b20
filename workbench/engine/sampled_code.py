"""Machine code of sampling instants: inside the run of a plant, and of a law with its guard alone."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import casadi as ca

from ..plant import Plant
from . import object_cache
from .codegen import gathered_inputs
from .emit import emit
from .guard_shape import length
from .instant import controller_instant, instant
from .jobs import Frame
from .lanes import Code
from .sampled_law import LawShape
from .tape import divide_less, read


@dataclass(frozen=True)
class SampledLaw:
    """Machine code of a plant's sampling instants, `sample`: for one lane and for blocks of lanes."""

    single: object_cache.Library
    block: object_cache.Library


def compile_law(plant: Plant, shape: LawShape) -> SampledLaw:
    """Machine code for a law of this shape on a plant, from the cache where it has been compiled before.

    Raises OSError or RuntimeError where this machine cannot compile.
    """
    graph, fused = instant(plant, shape), object_cache.fused()
    libraries = []
    for width in (1, object_cache.vector_width()):
        key = ("sample", graph.serialize(), str(width), str(fused), str(shape))
        write = partial(_module, graph, plant, shape, width, fused)
        libraries.append(object_cache.load(key, write, ("sample",)))
    return SampledLaw(*libraries)


def compile_controller(shape: LawShape) -> object_cache.Library:
    """Machine code `controller(law, row, numbers, out)` of a law and its guard: the state at `law` changes in place,
    `out` gets the command sent, the one demanded, and the trip.

    Raises OSError or RuntimeError where this machine cannot compile.
    """
    graph, fused = controller_instant(shape), object_cache.fused()
    key = ("controller", graph.serialize(), str(fused), str(shape))
    return object_cache.load(key, partial(_controller_module, graph, shape, fused), ("controller",))


def _controller_module(graph: ca.Function, shape: LawShape, fused: bool) -> str:
    """IR of `controller`."""
    tape, code, states = divide_less(read(graph), {2}), Code(1, fused), length(shape.state)
    sources: dict[int, Callable[[int], str]] = {
        argument: (lambda e, name=name: f"ptr %{name}, i64 {e}")
        for argument, name in enumerate(("law", "row", "numbers"))
    }
    values = emit(code, tape, [node for _, node in tape.results], gathered_inputs(code, tape, sources))
    for element, node in tape.results:
        target = f"ptr %law, i64 {element}" if element < states else f"ptr %out, i64 {element - states}"
        code.write(f"store double {values[node]}, ptr {code.do(f'getelementptr double, {target}')}")
    head = "define void @controller(ptr %law, ptr %row, ptr %numbers, ptr %out) nounwind {"
    return "\n".join([head, "entry:", *code.lines, "  ret void", "}", *sorted(code.declared)])


def _module(graph: ca.Function, plant: Plant, shape: LawShape, width: int, fused: bool) -> str:
    """IR of `sample(slot, law, row, numbers, out)` for one lane of a block of `width`."""
    tape, code = divide_less(read(graph), {2, 5}), Code(1, fused)
    frame = Frame(width, plant.n, len(plant.inputs), len(plant.parameters), 0).places
    sources: dict[int, Callable[[int], str]] = {
        argument: (lambda e, first=frame[name]: f"ptr %slot, i64 {first + e * width}")
        for argument, name in enumerate("xup")
    }
    for argument, name in ((3, "law"), (4, "row"), (5, "numbers")):
        sources[argument] = lambda e, name=name: f"ptr %{name}, i64 {e}"
    values = emit(code, tape, [node for _, node in tape.results], gathered_inputs(code, tape, sources))
    inputs, states = len(plant.inputs), length(shape.state)
    for element, node in tape.results:
        target = f"ptr %slot, i64 {frame['u'] + element * width}"
        if element >= inputs + states:
            target = f"ptr %out, i64 {element - inputs - states}"
        elif element >= inputs:
            target = f"ptr %law, i64 {element - inputs}"
        code.write(f"store double {values[node]}, ptr {code.do(f'getelementptr double, {target}')}")
    head = "define void @sample(ptr %slot, ptr %law, ptr %row, ptr %numbers, ptr %out) nounwind {"
    return "\n".join([head, "entry:", *code.lines, "  ret void", "}", *sorted(code.declared)])
