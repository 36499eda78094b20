"""Whether the records that are to show the noise were made at rest."""

from collections.abc import Sequence

import numpy as np

from ...base.errors import InputError
from ...base.signals import SIGNALS
from ...records import Campaign, Record
from .white_part import white_part

_NOISE, _SHARE = 30.0, 0.01  # times the white noise, and of how far it goes elsewhere: who goes farther is not at rest
_TELLING = ("position", "velocity", "force")


def check_static(campaign: Campaign) -> None:
    """Raises InputError for a static record that moves: its motion would count as noise, and hide every misfit."""
    moving = (*campaign.train, *campaign.select, *campaign.heldout)
    for record in campaign.static:
        for name in [name for name in _TELLING if name in record.signals]:
            rest, motion = _spread([record], name), _spread(moving, name)
            if rest > max(_SHARE * motion, _NOISE * white_part(name, [record]).sigma) > 0:
                there, elsewhere = (SIGNALS[name].text(float(f"{spread:.2g}")) for spread in (rest, motion))
                raise InputError(
                    f"{campaign.path}: static record {record.name} moves: {name} varies by {there} there and by "
                    f"{elsewhere} in the records that move; list one at rest, or a part of it by "
                    '{file = "...", from = 0.0, to = 0.5}, or none'
                )


def _spread(records: Sequence[Record], name: str) -> float:
    """Standard deviation [SI] about a straight line of the record in which a signal goes farthest."""
    carriers = [record for record in records if name in record.signals and record.t.size > 2]
    return max((_about_line(record.t, record.signals[name]) for record in carriers), default=0.0)


def _about_line(t: np.ndarray, values: np.ndarray) -> float:
    basis = np.linalg.qr(np.column_stack((np.ones(t.size), t - t.mean())))[0]
    return float(np.std(values - basis @ (basis.T @ values)))
