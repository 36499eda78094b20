"""Valves and pumps of a catalogue, from a TOML of tables `[valve.NAME]` and `[pump.NAME]`."""

from dataclasses import dataclass
from pathlib import Path

from ...base.table import ConfigTable
from ...base.toml import read_toml
from ...base.units import Spec
from ...loop.performance.drive import RATED, CataloguePump, CatalogueValve

_FLOW = Spec("m^3/s", 1e-9, 10.0, "rated flow")
_DROP = Spec("Pa", 1e4, 1e8, "pressure drop over both lands at the rated flow")
_BANDWIDTH = Spec("Hz", 0.1, 1e4, "-3 dB of small commands")


@dataclass(frozen=True)
class Catalogue:
    """Its entries."""

    valves: tuple[CatalogueValve, ...]
    pumps: tuple[CataloguePump, ...]


def load_catalogue(path: str | Path) -> Catalogue:
    """Read the file. Raises InputError with file and key."""
    top = read_toml(Path(path)).allow("valve", "pump")
    valves, pumps = (top.optional_table(key) for key in ("valve", "pump"))
    if not len(valves) + len(pumps):
        raise top.error("has no [valve.NAME] and no [pump.NAME]; write one")
    return Catalogue(
        tuple(_valve(name, valves.table(name, "flow", "drop", "bandwidth", "price", "order")) for name in valves),
        tuple(_pump(name, pumps.table(name, "flow", "price", "order")) for name in pumps),
    )


def _valve(name: str, table: ConfigTable) -> CatalogueValve:
    drop = table.quantity("drop", _DROP) if "drop" in table else RATED
    return CatalogueValve(
        name, table.quantity("flow", _FLOW), drop, table.quantity("bandwidth", _BANDWIDTH), *_order(table)
    )


def _pump(name: str, table: ConfigTable) -> CataloguePump:
    return CataloguePump(name, table.quantity("flow", _FLOW), *_order(table))


def _order(table: ConfigTable) -> tuple[float | None, str]:
    return table.positive("price") if "price" in table else None, table.text("order", "")
