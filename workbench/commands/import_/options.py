"""`jackbench import FILE ... --rig RIG`: recordings as labs leave them, made a campaign folder."""

import argparse
from functools import partial
from hashlib import sha256
from pathlib import Path

from ...base.errors import InputError
from ...base.files import MEBIBYTE, open_file
from ...records.foreign.open import check_foreign
from ...rigs.rig_file import load_rig
from ..common.options import computes, finish_in_folder


def options(parser: argparse.ArgumentParser) -> None:
    """What it is asked."""
    parser.add_argument("files", type=Path, nargs="+", metavar="FILE", help="recordings of one rig, of any kind")
    parser.add_argument("--rig", required=True, help="the bundled rig or rig file that the columns are compared with")
    computes(parser, _import, rig=False)


def _import(options: argparse.Namespace, words: list[str]) -> None:
    for path in options.files:
        check_foreign(path)
    rig = load_rig(options.rig)
    if not rig.is_jack:
        raise InputError(f"--rig {options.rig}: a linear plant has signals of its own; write its campaign.toml by hand")
    digests = {str(path): _digest(path) for path in options.files}
    if len(digests) < len(options.files):
        raise InputError("import: a file is named twice; name it once")
    from .page import column_lines
    from .study import run_import

    identity = {"command": "import", "rig": rig.table(), "files": digests}
    study = partial(run_import, options.files, rig, options.rig)
    outcome = finish_in_folder(options, words, f"import-{rig.name}", identity, study)
    print(column_lines(outcome.metrics))


def _digest(path: Path) -> str:
    with open_file(path, kind="recording") as file:
        digest = sha256()
        while block := file.read(MEBIBYTE):
            digest.update(block)
    return digest.hexdigest()
