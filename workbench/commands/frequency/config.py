"""What a frequency response is measured on: records of a campaign, two columns of any recordings, or the sheet of a
datasheet curve."""

from collections.abc import Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from ...base.errors import InputError, nearest
from ...base.signals import SIGNALS
from ...base.units import from_si, to_si
from ...records import Campaign, Record, load_campaign
from ...records.fingerprint import digest, fingerprint
from ...records.frequency_sheet import FrequencySheet, read_sheet
from ...records.pair import RecordedPair, read_pair
from ...rigs.driven import driven
from ...rigs.rig import Rig
from ...rigs.rig_file import load_rig


@dataclass(frozen=True)
class FrequencyTask:
    """What is compared: `records` of a campaign, or sheets, with a rig; or recorded `pairs` of columns, without one;
    `pair` is input and output."""

    rig: Rig | None
    source: str
    pair: tuple[str, str]
    records: tuple[Record, ...] = ()
    sheets: tuple[FrequencySheet, ...] = ()
    campaign: Campaign | None = None
    period: float | None = None
    pairs: tuple[RecordedPair, ...] = ()


def load(
    paths: str | Path | Sequence[str | Path],
    pair: tuple[str, str],
    rig: str | None = None,
    only: Sequence[str] = (),
    period: float | None = None,
    amplitude: float | None = None,
    alone: bool = False,
) -> FrequencyTask:
    """A campaign folder, of which the held-out records or those named in `only`; or the file of a sheet; or, without a
    rig, recordings with the two columns.

    `period` [s] of periodic records; `amplitude` of a sheet in the unit of its input (1, mA, mm). Records that lack
    what drives the rig have no model beside them; nor have those that are asked for `alone`. Raises InputError.
    """
    files = [Path(path) for path in ([paths] if isinstance(paths, str | Path) else paths)]
    recordings = [not path.is_dir() and path.suffix != ".toml" for path in files]
    if all(recordings) and rig is None:
        pairs = tuple(read_pair(path, *pair) for path in files)
        if len({each.units for each in pairs}) > 1:
            raise InputError(f"{files[0]}: the columns have other units than in {files[-1]}; convert them to one")
        return FrequencyTask(None, "+".join(each.record.name for each in pairs), pair, period=period, pairs=pairs)
    if len(files) > 1:
        raise InputError(f"{files[1]}: give one campaign, one sheet, or recordings without --rig")
    path = files[0]
    for name in pair:
        if name not in SIGNALS or name == "t":
            raise InputError(f'no signal "{name}"; {nearest(name, [known for known in SIGNALS if known != "t"])}')
    if recordings[0]:
        assert rig is not None
        signal = SIGNALS[pair[0]]
        size = None if amplitude is None else float(to_si(amplitude, signal.unit, signal.si))
        return FrequencyTask(load_rig(rig), path.stem, pair, sheets=(read_sheet(path, size, *pair),))
    campaign = load_campaign(path)
    own = load_rig(rig or campaign.rig, corrector=campaign.corrector)
    every = {record.name: record for record in campaign.records}
    for name in only:
        if name not in every:
            raise InputError(f'{path}: no record "{name}"; {nearest(name, every)}')
    records = tuple(every[name] for name in only) or campaign.heldout
    source = campaign.path.resolve().name
    if alone or (own.inner is None and any("command" not in record.signals for record in records)):
        return FrequencyTask(None, source, pair, period=period, pairs=tuple(_shown(each, pair) for each in records))
    campaign = driven(campaign, own)
    every = {record.name: record for record in campaign.records}
    records = tuple(every[record.name] for record in records)
    sheets = tuple(sheet for sheet in campaign.sheets if (sheet.input, sheet.output) == pair)
    return FrequencyTask(own, source, pair, records, sheets, campaign, period)


def _shown(record: Record, pair: tuple[str, str]) -> RecordedPair:
    """Two signals of a record in the units that people read."""
    for name in pair:
        if name not in record.signals:
            raise InputError(f"record {record.name}: no signal {name}; {nearest(name, record.names)}")
    units = tuple(SIGNALS[name].unit for name in pair)
    signals = {name: from_si(record.signals[name], SIGNALS[name].unit, SIGNALS[name].si) for name in pair}
    own = Record(record.name, record.t, signals, {name: record.valid[name] for name in pair}, record.notes)
    return RecordedPair(own, *pair, (units[0], units[1]))


def identity(task: FrequencyTask) -> dict[str, Any]:
    """What says, beside the rig, that a comparison is the same one."""
    sheets = {
        sheet.name: sha256(b"".join(np.ascontiguousarray(a).tobytes() for a in (sheet.f, sheet.response))).hexdigest()[
            :16
        ]
        for sheet in task.sheets
    }
    if task.pairs:
        return {"pairs": [digest(each.record) for each in task.pairs], "pair": list(task.pair), "period": task.period}
    return {
        "campaign": None if task.campaign is None else fingerprint(task.campaign),
        "records": [record.name for record in task.records],
        "sheets": sheets,
        "amplitudes": [sheet.amplitude for sheet in task.sheets],
        "pair": list(task.pair),
        "period": task.period,
    }
