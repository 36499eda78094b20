"""The rigs of an experiment's set: standard variations of its rig, its own as tables [variation.NAME], rig files."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from ...base.table import ConfigTable
from ...base.units import Spec
from ...loop.rig_variations import RIG_SET, variation
from ...rigs.rig import Rig
from ...rigs.rig_file import load_rig
from .declared import ExperimentFile
from .experiment import with_specimen

_ANY = float("inf")
RIGS = {
    "rigs": "standard variations, tables [variation.NAME], or rig files",
    "variation": "rigs of the set by name, with `factors` on numbers of the rig, or other `values`",
}


def checked_rig_set(at: ExperimentFile) -> dict[str, Rig]:
    """The set of an experiment's rig, by name. Raises InputError for a variation that no list names, too."""
    rigs = read_rig_set(at.top, "rigs", at.top, at.rig)
    check_variations(at.top, rigs)
    return rigs


def read_rig_set(rigs: ConfigTable, key: str, top: ConfigTable, rig: Rig) -> dict[str, Rig]:
    """The rigs that a list names, by name: variations of `rig`, or files, which are named without .toml.

    `rigs` is the table with the list under `key`, `top` the experiment, whose specimen every file's rig gets where
    `rig` has one. Raises InputError.
    """
    names = rigs.words(key, "nominal")
    own = top.optional_table("variation")
    members = [
        replace(_varied(rig, own.table(name, "factors", "values")), name=name)
        if name in own
        else rigs.about(key, lambda name=name: _named(name, top, rig))
        for name in names
    ]
    for i, member in enumerate(members):
        if member.name in [other.name for other in members[:i]]:
            raise rigs.complaint(key, f'two rigs are named "{member.name}"; rename one')
    return {member.name: member for member in members}


def check_variations(top: ConfigTable, names: Iterable[str]) -> None:
    """Raises InputError for a table [variation.NAME] that no list names, or whose name is that of a standard one."""
    tables, listed = top.optional_table("variation"), set(names)
    for name in tables:
        if name in RIG_SET:
            raise tables.complaint(name, "is a standard variation; choose another name")
        if name not in listed:
            raise tables.complaint(name, "is not in the list `rigs`; add it there or remove the table")


def _named(name: str, top: ConfigTable, rig: Rig) -> Rig:
    """A standard variation, or the rig of a file."""
    if not name.endswith(".toml"):
        return variation(rig, name)
    other = load_rig(name, Path(top.place.document).parent)
    other = with_specimen(other, top.table("specimen")) if rig.specimen_stiffness and "specimen" in top else other
    return replace(other, name=Path(name).stem)


def _varied(rig: Rig, table: ConfigTable) -> Rig:
    """The rig with factors on its numbers, and with other values."""
    factors, values = table.optional_table("factors"), table.optional_table("values")
    if not len(factors) + len(values):
        raise table.error('varies nothing; write factors = {M = 1.5} or values = {beta = "0.7 GPa"}')
    if both := [name for name in factors if name in values]:
        raise values.complaint(both[0], "has a factor too; remove one")
    numbers = _known(rig, factors) | _known(rig, values)
    changed = {name: factors.positive(name) * rig[name] for name in factors}
    changed |= {name: values.quantity(name, Spec(numbers[name], -_ANY, _ANY, "")) for name in values}
    return table.about("values" if len(values) else "factors", lambda: rig.with_values(**changed))


def _known(rig: Rig, table: ConfigTable) -> dict[str, str]:
    """SI units of the numbers that a table names."""
    table.allow(*rig.numbers)
    return {name: rig.numbers[name].si for name in table}
