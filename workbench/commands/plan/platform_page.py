"""The report of a platform's plan: which motion is for which legs, and the platform as it makes the best one."""

from collections.abc import Mapping, Sequence
from typing import Any

from ...base.signals import SIGNALS
from ...base.words import listed
from ...identify.fit.free_parameters import Candidate
from ...identify.plan.family import SECONDS
from ...identify.plan.motions import PlannedMotion
from ...records import Campaign
from ...report import Figure, Page, Scene, Section, Table
from ...rigs.platform import AXES, LEGS, Platform
from ..common.platform_scene import platform_scene, pose_panels
from ..common.time_figure import signal_panel
from .page import Setting, page_of

_HOW = (
    "Each motion is played in simulation by the platform as fitted, a position loop and the speed's feed-forward on "
    "each leg, and its legs are cut out by their load cells as those of the campaign are. "
)
_PLAY = (
    "The .csv files beside this page have poses, as the platform's drive plays them. Rehearse them with jackbench "
    "record PLATFORM --play FILE.csv, add what the platform records to campaign.toml under train, and trace again."
)
_LEGS = (
    "chi2 of the train records as the leg's numbers fit, each part predicted by the others; 1 is the noise floor. "
    "Planned for are the legs that miss something, or all where none does."
)
_FRAME = 0.04  # s
_LARGER, _LARGE = 5.0, 0.1  # times a motion is drawn that is smaller than this, m at the joints


def platform_page(
    platform: Platform,
    whole: Sequence[Campaign],
    candidates: Mapping[str, Candidate],
    metrics: Mapping[str, Any],
    motions: Mapping[str, PlannedMotion],
) -> tuple[Page, Figure]:
    """The page and its telling figure, from metrics.json, the effects by name, and the motions by name."""
    best = [motions[row["record"]] for row in metrics["records"]]
    setting = Setting(
        whole[0].path.resolve().name,
        platform.name,
        "motion",
        _HOW,
        _PLAY,
        lambda row: f"{row['kind']} of {'all axes' if len(row['axes']) == LEGS else ', '.join(row['axes'])}",
        "peak at the joints [mm]",
        _poses(best),
        lambda: _recorded(whole),
        _strays(metrics),
        [Section("Legs", [*_scene(platform, best, metrics), _table(metrics)])],
    )
    return page_of(setting, candidates, metrics)


def _strays(metrics: Mapping[str, Any]) -> str:
    """Which legs miss something."""
    strays = [str(row["leg"]) for row in metrics["legs"] if not row["follows"]]
    if not strays:
        return "Each leg follows its records. "
    one = len(strays) == 1
    return f"{'Leg' if one else 'Legs'} {listed(strays)} {'misses' if one else 'miss'} something. "


def _table(metrics: Mapping[str, Any]) -> Table:
    rows = [
        [
            f"leg {row['leg']}",
            row["chi2"],
            row["planned"],
            sum(_of(row["leg"], pair["effects"][0]) for pair in metrics["pairs"]),
            sum(_of(row["leg"], number["number"]) for number in metrics["numbers"]),
            ", ".join(each["file"] for each in metrics["records"] if _serves(each, row["leg"])) or None,
        ]
        for row in metrics["legs"]
    ]
    head = ["leg", "chi2", "planned for", "pairs alike", "numbers not told", "motions"]
    return Table("What each leg needs", head, rows, _LEGS)


def _of(leg: int, name: str) -> bool:
    return name.startswith(f"leg{leg}.")


def _serves(record: Mapping[str, Any], leg: int) -> bool:
    return any(_of(leg, name) for name in (*(pair[0] for pair in record["splits"]), *record["tells"]))


def _scene(platform: Platform, best: Sequence[PlannedMotion], metrics: Mapping[str, Any]) -> list[Scene]:
    """The platform in the best motion, with the legs marked that it is for."""
    if not best:
        return []
    motion, record = best[0], metrics["records"][0]
    marked = {leg for leg in range(LEGS) if _serves(record, leg + 1)}
    poses = motion.course[:: max(1, round(_FRAME / motion.period))]
    larger = _LARGER if motion.size < _LARGE else 1.0
    note = f"Motion {motion.design.name}, drawn {larger:g} times larger, with the legs marked that it is best for."
    takes = {motion.design.name: larger * poses}
    return [platform_scene("The platform in the best motion", platform, takes, _FRAME, note, marked=marked)]


def _poses(best: Sequence[PlannedMotion]) -> Figure:
    """What the platform plays, axis by axis of those that move."""
    courses = {
        f"{motion.design.name}: {axis}": (axis, motion.t, values)
        for motion in best
        for axis, values in motion.columns().items()
        if axis in AXES
    }
    return Figure(f"What to play, {SECONDS:g} s each", "time [s]", pose_panels(courses))


def _recorded(whole: Sequence[Campaign]) -> Figure:
    """The commands of the first train record."""
    courses = {f"leg {i + 1}": (own.train[0].t, own.train[0].signals["command"]) for i, own in enumerate(whole)}
    panel = signal_panel(SIGNALS["command"], courses)
    return Figure(f"What was recorded: {whole[0].train[0].name}", "time [s]", [panel])
