"""Effects of hidden rigs, as an effect file: formulas that the library lacks, what it has no name for, and a transducer
of another scale."""

from dataclasses import replace

from experiments.studies.trace.off_library import OTHER_FORMULAS, UNNAMED
from workbench.commands.commission.transducers import scale_of_a


def named(name: str) -> str:
    """The name that a rig file can have for a cause without one."""
    return "hidden." + name.replace(" ", "_").replace("-", "_")


SCALE = scale_of_a.name
HIDDEN = (
    *OTHER_FORMULAS,
    *(replace(effect, name=named(effect.name)) for effect in UNNAMED),
    replace(scale_of_a, formula=""),
)

globals().update({f"_{i}": effect for i, effect in enumerate(HIDDEN)})  # an effect file has each under a name
