"""What a study leaves behind, and what it is given to work with."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...base.checkpoint import Progress, Stage, no_checkpoint
from ...report import Figure, Page

__all__ = ["Outcome", "Progress", "Stage", "no_checkpoint"]


@dataclass(frozen=True)
class Outcome:
    """`metrics` for metrics.json, `tables` for *.parquet (columns by name), the report and its telling figure.

    `files` are further text files, content by name.
    """

    metrics: Mapping[str, Any]
    page: Page
    picture: Figure
    tables: Mapping[str, Mapping[str, np.ndarray]] = field(default_factory=dict)
    files: Mapping[str, str] = field(default_factory=dict)
