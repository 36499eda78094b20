"""What commands are asked that leave a sheet: a campaign or a rig, limits, and a PDF."""

import argparse
import json
from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...base.errors import InputError
from ...records.campaign import FILE, Campaign, campaign_rig, load_campaign
from ...rigs.platform import bundled_platforms
from ...rigs.rig import Rig
from ...rigs.rig_file import bundled, load_rig
from .options import Call, bounded, computes
from .shipped import campaign

if TYPE_CHECKING:
    from ...identify.acceptance.row import AcceptanceLimit

Rows = Mapping[str, Mapping[str, Any]]  # lines of a sheet by id, as metrics.json has them


@dataclass(frozen=True)
class Made:
    """What making a sheet again needs: the name of what it is of, digests of every file that was read by name, and the
    seed of the noise where there is one."""

    of: str
    digests: dict[str, str]
    seed: int | None = None


@dataclass(frozen=True, eq=False)
class Asked:
    """What a sheet is of: a rig, its campaign where records say the figures, else a seed to play with; limits by line,
    and digests of every file that was read, by name."""

    rig: Rig
    campaign: Campaign | None
    seed: int
    limits: "dict[str, AcceptanceLimit]"
    digests: dict[str, str]

    @property
    def name(self) -> str:
        """The campaign's folder, or the rig."""
        return self.campaign.path.name if self.campaign else self.rig.name

    @property
    def made(self) -> Made:
        """What making it again needs."""
        return Made(self.rig.name, self.digests, self.seed)


def sheet_options(parser: argparse.ArgumentParser, call: Call, subject: str = "CAMPAIGN|RIG") -> None:
    """Options of a command that leaves a sheet."""
    recorded = "CAMPAIGN" in subject
    what = "a campaign folder, or a bundled rig or a rig file, which is then played"
    parser.add_argument("subject", metavar=subject, help=what if recorded else "a bundled rig or platform, or its file")
    parser.add_argument(
        "--limits", type=Path, metavar="FILE", help="a TOML with the maker's values and limits, line by line"
    )
    if recorded:
        bounded(parser, "--seed", 0, "seed of a played rig's sensor noise (default: 0)", default=0)
    parser.add_argument(
        "--pdf", action="store_true", help="also print the sheet into sheet.pdf, with an installed Chromium"
    )
    computes(parser, call, rig=recorded)


def asked(options: argparse.Namespace) -> Asked:
    """What the options say. Raises InputError."""
    folder = campaign(options.subject)
    is_campaign = folder.is_dir() or folder.name == FILE
    loaded = load_campaign(folder) if is_campaign else None
    rig = load_rig(options.rig or campaign_rig(folder)) if is_campaign else load_rig(options.subject)
    check_jack(rig)
    limits, digests = limits_of(options.limits)
    own = campaign_digests(loaded) if loaded else file_digests(options.subject)
    return Asked(rig, loaded, options.seed, limits, own | digests)


def check_jack(rig: Rig) -> None:
    """Raises InputError for what is no jack."""
    if not rig.is_jack:
        raise InputError(f"{rig.name}: is no jack with a valve; name one")


def check_metered(rig: Rig) -> None:
    """Raises InputError for a rig whose lands do not see the chambers' pressures, which formulas of them need."""
    if not rig.is_metered:
        raise InputError(
            f"{rig.name}: its line valve parts the lands from the chambers, whose pressures are taken for theirs here; "
            "name a rig without [line_valve]"
        )


def limits_of(path: Path | None) -> "tuple[dict[str, AcceptanceLimit], dict[str, str]]":
    """Limits by line, and the digest of their file. Raises InputError."""
    if path is None:
        return {}, {}
    from ...identify.acceptance.row import read_limits

    return read_limits(path), file_digests(path)


def read_lines(path: Path) -> Rows:
    """The lines of a valve's sheet that have a value, by id, from metrics.json. Raises InputError for what is none."""
    try:
        rows = json.loads(path.read_text(encoding="utf-8"))["rows"]
        return {row["id"]: row for row in rows if row["value"] is not None and row["low"] <= row["high"]}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path}: no sheet of valve-test ({type(error).__name__}); name its metrics.json") from None


def limit_tables(limits: "Mapping[str, AcceptanceLimit]") -> dict[str, Any]:
    """The limits as an identity has them."""
    return {name: vars(limit) for name, limit in limits.items()}


def identity(command: str, sheet: Asked) -> dict[str, Any]:
    """What says that a sheet is the same one."""
    limits = limit_tables(sheet.limits)
    return {"command": command, "rig": sheet.rig.table(), "seed": sheet.seed, "limits": limits, "files": sheet.digests}


def campaign_digests(loaded: Campaign) -> dict[str, str]:
    """SHA-256 of the files of a campaign."""
    return file_digests(*sorted(path for path in loaded.path.iterdir() if path.is_file()))


def file_digests(*names: str | Path) -> dict[str, str]:
    """SHA-256 of files by name; what is bundled is of jackbench's version."""
    paths = [Path(name) for name in names if name not in (*bundled(), *bundled_platforms())]
    return {path.name: sha256(path.read_bytes()).hexdigest() for path in paths}
