"""How much structure the records of a closed loop bear: servos of few numbers beside the plant, by held-out error."""

from collections.abc import Mapping, Sequence
from typing import Any

from ...base.signals import SIGNALS
from ...base.units import from_si
from ...identify.fit.servo import Servo, fit_servos
from ...identify.trace.problem import EstimationProblem
from ...report import Section, Table

_AS_GOOD = 1.05  # of the least error: fewer numbers are as good
_LOST = 0.5  # of the movement: what leaves more follows nothing
_PLANT = "this plant"
_UNITS = {"s": ("ms", 1e3), "m": ("mm", 1e3), "m/N": ("mm/kN", 1e6)}


def ladder(problem: EstimationProblem, shares: Mapping[str, Any]) -> dict[str, Any]:
    """`ladder`, where `shares` say what a rig with an inner loop leaves: `rungs`, servos and then the plant as fitted,
    each with what it leaves in the held-out windows, and the first that is as good as the best, which the records
    bear; None where nothing follows."""
    loop, share = problem.rig.inner, shares.get("shares")
    if loop is None or share is None or share["left"] is None:
        return {}
    signal = SIGNALS[loop.controls]
    servos = fit_servos(loop, signal.si, problem.train, problem.heldout)
    rungs = [
        {"rung": _words(servo), "left": float(from_si(servo.heldout, signal.unit, signal.si)), "numbers": servo.numbers}
        for servo in servos
    ]
    rungs.append({"rung": _PLANT, "left": share["left"], "numbers": {}})
    enough = _AS_GOOD * min(rung["left"] for rung in rungs)
    follows = enough < _LOST * share["moves"]
    bears = next(rung["rung"] for rung in rungs if rung["left"] <= enough) if follows else None
    return {"ladder": {"bears": bears, "unit": share["unit"], "rungs": rungs}}


def ladder_sentence(ladder: Mapping[str, Any]) -> str:
    """What the records bear, and what more or less structure leaves."""
    unit, rungs = ladder["unit"], ladder["rungs"]
    if ladder["bears"] is None:
        return " Neither a servo nor this plant follows what was recorded; check which column is the reference."
    borne = next(rung for rung in rungs if rung["rung"] == ladder["bears"])
    others = ", ".join(f"{rung['rung']} {rung['left']:.3g}" for rung in rungs if rung is not borne)
    if borne["rung"] == _PLANT:
        return f" The records bear this plant: a servo leaves more ({others} {unit})."
    return (
        f" The records bear a servo of {borne['rung']}, and no more: {_numbers(borne)}; it leaves {borne['left']:.3g} "
        f"{unit} ({others})."
    )


def ladder_section(ladder: Mapping[str, Any]) -> Section:
    """Each rung with its numbers."""
    rows = [[rung["rung"], _numbers(rung), rung["left"]] for rung in ladder["rungs"]]
    note = f"Fitted to the train windows; fewer numbers are as good within {_AS_GOOD - 1:.0%} of the least error."
    table = Table("Structure", ["structure", "numbers, 95 %", f"left, held out [{ladder['unit']}]"], rows, note=note)
    return Section("How much structure the records bear", [table])


def _words(servo: Servo) -> str:
    order = "second order" if "damping [1]" in servo.numbers else "first order"
    return order + (", yielding to the force" if any(name.startswith("compliance") for name in servo.numbers) else "")


def _numbers(rung: Mapping[str, Any]) -> str:
    return ", ".join(_shown(name, value) for name, value in rung["numbers"].items())


def _shown(name: str, value: Sequence[float]) -> str:
    """A number with half its interval, in the unit that people read: "delay 3.98 +- 0.04 ms"."""
    word, own = name.rstrip("]").split(" [")
    unit, times = _UNITS.get(own, (own, 1.0))
    half = (value[2] - value[1]) / 2
    told = f"{word} {times * value[0]:.3g}"
    return (
        f"{told}, not told"
        if half > abs(value[0])
        else f"{told} +- {times * half:.2g}{'' if unit == '1' else f' {unit}'}"
    )
