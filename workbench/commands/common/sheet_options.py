"""What commands are asked that leave a sheet: a campaign or a rig, limits, and a PDF."""

import argparse
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...base.errors import InputError
from ...records.campaign import FILE, Campaign, campaign_rig, load_campaign
from ...rigs.rig import Rig
from ...rigs.rig_file import bundled, load_rig
from .options import Call, computes
from .shipped import campaign

if TYPE_CHECKING:
    from ...identify.acceptance.row import Limit


@dataclass(frozen=True, eq=False)
class Asked:
    """What a sheet is of: a rig, its campaign where records say the figures, else a seed to play with; limits by line,
    and digests of every file that was read, by name."""

    rig: Rig
    campaign: Campaign | None
    seed: int
    limits: "dict[str, Limit]"
    digests: dict[str, str]

    @property
    def name(self) -> str:
        """The campaign's folder, or the rig."""
        return self.campaign.path.name if self.campaign else self.rig.name


def sheet_options(parser: argparse.ArgumentParser, call: Call, subject: str = "CAMPAIGN|RIG") -> None:
    """Options of a command that leaves a sheet."""
    what = "a campaign folder, or a bundled rig or a rig file, which is then played"
    parser.add_argument(
        "subject", metavar=subject, help=what if "CAMPAIGN" in subject else "a bundled rig or a rig file"
    )
    parser.add_argument("--limits", type=Path, metavar="FILE", help="a TOML: by line, what the maker states and limits")
    parser.add_argument("--seed", type=int, default=0, help="of the sensor noise of a played rig (default: 0)")
    parser.add_argument(
        "--pdf", action="store_true", help="print the sheet into sheet.pdf too, by an installed Chromium"
    )
    computes(parser, call, rig="CAMPAIGN" in subject)


def asked(options: argparse.Namespace, campaigns: bool = True) -> Asked:
    """What the options say. Raises InputError."""
    if options.seed < 0:
        raise InputError(f"--seed {options.seed}: must be 0 or more")
    folder = campaign(options.subject)
    is_campaign = campaigns and (folder.is_dir() or folder.name == FILE)
    loaded = load_campaign(folder) if is_campaign else None
    rig = load_rig(options.rig or campaign_rig(folder)) if is_campaign else load_rig(options.subject)
    if not rig.is_jack:
        raise InputError(f"{options.subject}: {rig.name} is no jack with a valve; name one")
    if options.limits is None:
        return Asked(rig, loaded, options.seed, {}, _digests(loaded, options.subject))
    from ...identify.acceptance.row import read_limits

    limits, digests = read_limits(options.limits), _digests(loaded, options.subject)
    return Asked(rig, loaded, options.seed, limits, digests | {options.limits.name: _digest(options.limits)})


def identity(command: str, sheet: Asked) -> dict[str, Any]:
    """What says that a sheet is the same one."""
    limits = {name: vars(limit) for name, limit in sheet.limits.items()}
    return {"command": command, "rig": sheet.rig.table(), "seed": sheet.seed, "limits": limits, "files": sheet.digests}


def _digests(loaded: Campaign | None, subject: str) -> dict[str, str]:
    """SHA-256 of the files of a campaign, or of a rig file; a bundled rig is of jackbench's version."""
    if loaded is not None:
        files = sorted(path for path in loaded.path.iterdir() if path.is_file())
        return {path.name: _digest(path) for path in files}
    return {} if subject in bundled() else {Path(subject).name: _digest(Path(subject))}


def _digest(path: Path) -> str:
    return sha256(path.read_bytes()).hexdigest()
