"""Recordings of a live rig as a campaign folder."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from ...base.toml_text import toml_text
from ...link.client import LinkClient
from ...link.wire_loop import acts_after_its_row
from ...records import Record
from ...records.frequency_sheet import table_text
from ...rigs.rig import Rig
from ...rigs.rig_file import rig_text

OWN = "rig.toml"


def wire_campaign(
    rig: Rig, client: LinkClient, static: Record, records: Mapping[str, Record], heldout: Sequence[str]
) -> dict[str, str]:
    """Its files by name: `records` by name but for `static` are train or held out; campaign.toml says how late their
    commands act after the readings of their rows."""
    roles = {
        "static": ["static.csv"],
        "train": [f"{name}.csv" for name in records if name not in heldout],
        "heldout": [f"{name}.csv" for name in heldout],
    }
    after = acts_after_its_row(client.hello.period, client.hello.lockstep, rig.computing_delay.value)
    late = {"value": 1e3 * after, "unit": "ms"}
    files = {
        "campaign.toml": toml_text({"rig": OWN, "late": late, "records": roles}),
        OWN: rig_text(replace(rig, name="rig")),
    }
    both = {"static": static, **records}
    return files | {f"{name}.csv": table_text({"t": each.t, **each.signals}) for name, each in both.items()}
