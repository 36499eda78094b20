"""Effects of hidden rigs, as an effect file: formulas that the library lacks, what it has no name for, and a transducer
of another scale."""

from dataclasses import replace
from typing import Any

from workbench.commands.trace_study.off_library import OTHER_FORMULAS, UNNAMED
from workbench.plant.effects import Effect, EffectNumber, Scope


def named(name: str) -> str:
    """The name that a rig file can have for a cause without one."""
    return "hidden." + name.replace(" ", "_").replace("-", "_")


def _scale(pressure: Any, s: Scope) -> Any:
    """pA (1 + e)."""
    return pressure * (1 + s.p("e"))


SCALE = "sensor.scale"
HIDDEN = (
    *OTHER_FORMULAS,
    *(replace(effect, name=named(effect.name)) for effect in UNNAMED),
    Effect(
        SCALE,
        "",
        "sensor",
        "none: nobody published it as a servo-valve's",
        "",
        {"sensor_pa": _scale},
        (EffectNumber("e", "1", "1", 0.03, -0.2, 0.2, "error of the scale", off=0.0),),
    ),
)

globals().update({f"_{i}": effect for i, effect in enumerate(HIDDEN)})  # an effect file has each under a name
