"""The excitations of a sheet, a file for each record that it needs: of a valve on its bench, of a rig's load cell."""

from collections.abc import Callable, Sequence
from pathlib import Path

from ...base.errors import InputError
from ...base.words import counted
from ...identify.acceptance.excitations import bench_excitations
from ...records.excitation import Excitation, excitation_text
from ...rigs.rig import Rig
from ..common.new_folder import check_new, write_folder
from .config import FORCE_TEST, VALVE_TEST

_HOW = {
    VALVE_TEST: (
        "for the valve alone on its test bench: no jack stays in its stroke under them",
        "valve-pressure: block the load ports; all others: hold the valve's pressure drop",
    ),
    FORCE_TEST: (
        "for the rig with its specimen, held by a slow position loop",
        "jackbench record RIG --at ADDRESS --play FILES plays them; record reference_force by a reference cell",
    ),
}


def write_set(kind: str, rig: Rig, out: Path) -> str:
    """Write them into a new folder; the sentences to print. Raises InputError, writing nothing."""
    check_new(out)
    waves = sheet_excitations(kind, rig)
    write_folder(out, {f"{wave.name}.csv": excitation_text(wave) for wave in waves})
    seconds, (what, how) = sum(wave.t[-1] for wave in waves), _HOW[kind]
    files = counted(len(waves), "excitation")
    return "\n".join([f"{files} of {seconds:.0f} s in all, {what}", how, f"written: {out}"])


def sheet_excitations(kind: str, rig: Rig) -> Sequence[Excitation]:
    """The excitations of a sheet of a kind. Raises InputError for a rig that has no such thing to test."""
    return _DESIGNED[kind](rig)


def _valve(rig: Rig) -> Sequence[Excitation]:
    if not (rig.is_jack and rig.is_throttled):
        raise InputError(f"{rig.name}: has no valve with lands to test; name a rig with a servo-valve")
    return list(bench_excitations(rig).values())


def _force(rig: Rig) -> Sequence[Excitation]:
    from ..force_test.bench import ForceBench

    if not rig.is_jack:
        raise InputError(f"{rig.name}: is no jack with a load cell; name one")
    return ForceBench(rig, 0).waves()


_DESIGNED: dict[str, Callable[[Rig], Sequence[Excitation]]] = {VALVE_TEST: _valve, FORCE_TEST: _force}
