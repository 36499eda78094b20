"""The excitations of a valve's sheet, a file for each record that it needs."""

from pathlib import Path

from ...base.errors import InputError
from ...identify.acceptance.excitations import bench_excitations
from ...records.excitation import excitation_text
from ...rigs.rig import Rig
from ..common.new_folder import check_new, write_folder


def write_valve_test(rig: Rig, out: Path) -> str:
    """Write them into a new folder; the sentences to print. Raises InputError, writing nothing."""
    if not (rig.is_jack and rig.is_throttled):
        raise InputError(f"{rig.name}: has no valve with lands to test; name a rig with a servo-valve")
    check_new(out)
    waves = bench_excitations(rig)
    write_folder(out, {f"{name}.csv": excitation_text(wave) for name, wave in waves.items()})
    seconds = sum(wave.t[-1] for wave in waves.values())
    return "\n".join([
        f"{len(waves)} excitations of {seconds:.0f} s in all, for the valve alone on its test bench: no jack stays in "
        "its stroke under them",
        "valve-pressure: block the load ports; all others: hold the valve's pressure drop",
        f"written: {out}",
    ])  # fmt: skip
