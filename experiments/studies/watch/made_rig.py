"""Made rigs over months: a reference run a week; oil, supply and noise wander, and one wear grows, or none."""

import gzip
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import date, timedelta
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from workbench.identify.watch.history import FEWEST

from ..trace.campaigns.cause import LIBRARY_CAUSES, OTHER_FORMULA_CAUSES, UNNAMED_CAUSES, Cause
from ..trace.campaigns.draw import CampaignPlan, written_records
from ..trace.campaigns.noise import Noise
from ..trace.campaigns.scene import Scene

FIRST_DAY = date(2025, 1, 6)
WEEK = 7
SEASON, DAILY = 6.0, 2.0  # K, of the oil about its mean: over a year, and from session to session
PER_KELVIN = {"b": -0.03, "beta": -0.004, "Cl": 0.02}  # of the number: what is true of made oils, a watch has its own
SUPPLY = (0.003, 0.02)  # of the supply pressure, from session to session: of a steady rig, of an unsteady one
NOISIER = 0.15  # of each sensor's noise, from session to session

Growth = Literal["slow", "jump", "steps"]
Pace = Literal["steady", "unsteady", "faster"]  # of wears whose forecasts are drawn
Mix = dict[Cause, dict[str, float]]


@dataclass(frozen=True)
class Wear:
    """What grows: a number of the rig to `most` times its first value, an effect to `most` of typical, or the scale of
    a sensor by `most`. Of an effect that the library has no name for, `formula` is empty."""

    name: str
    formula: str
    most: float

    @property
    def sensor(self) -> str:
        """The sensor that wears, if one does."""
        return self.name.removesuffix(".scale") if self.name.endswith(".scale") else ""

    @property
    def cause(self) -> Cause | None:
        """The effect that grows, if it is one."""
        every = (*OTHER_FORMULA_CAUSES, *LIBRARY_CAUSES, *UNNAMED_CAUSES)
        return next((cause for cause in every if cause.key == (self.name, self.formula)), None)

    @property
    def is_unnamed(self) -> bool:
        """Whether the library has no name for it, so that "unknown" is the right answer."""
        return self.cause in UNNAMED_CAUSES


WEARS = (
    Wear("Cl", "", 6.0),
    Wear("K3", "", 1.3),
    Wear("Ps", "", 0.9),
    Wear("Kp", "", 0.75),
    Wear("jack.friction", "hyperbolic", 0.6),
    Wear("main.deadband", "round ports", 0.4),
    Wear("oil.air", "dissolving", 0.6),
    Wear("jack.external_leakage", "seal that opens", 0.6),
    Wear("drive.delay", "shift and filter", 0.5),
    Wear("pa.scale", "", 0.05),
)
UNNAMED = Wear("detent of the main spool", "", 30.0)


@dataclass(frozen=True)
class MadeRig:
    """A rig of the study: its seed, what wears (none: healthy), how it grows, from which session on, its noise, the
    session before which it is `mended`, whether a remark tells of that, how far its supply wanders from session to
    session, of the pressure, whether somebody writes down the oil's temperature, and what wears `beside`."""

    seed: int
    wear: Wear | None
    growth: Growth = "slow"
    begins: int = 0
    sessions: int = 30
    noise: Noise = "white"
    mended: int | None = None
    said: bool = False
    supply: float = SUPPLY[0]
    thermometer: bool = True
    beside: "MadeRig | None" = None

    @property
    def id(self) -> str:
        """The name of its folder."""
        return f"{'+'.join(each.name for each in self.wears) or 'healthy'}-{self.growth}-{self.seed}"

    @property
    def wears(self) -> list[Wear]:
        """All that wears."""
        return [part.wear for part in self.parts if part.wear]

    @property
    def parts(self) -> list["MadeRig"]:
        """The rig with each of its wears alone."""
        return [self, *([self.beside] if self.beside else [])]

    def share(self, session: int) -> float:
        """How far the wear has grown in a session, 0 to 1."""
        if self.wear is None or session < self.begins or (self.mended is not None and session >= self.mended):
            return 0.0
        grown = (session - self.begins + 1) / (self.sessions - self.begins)
        return {"slow": grown, "jump": 0.5, "steps": np.ceil(3 * grown) / 3}[self.growth]


def drawn_rigs(
    number: int, seed: int, sessions: int, mend: bool = False, unsteady: bool = False, two: bool = False
) -> list[MadeRig]:
    """A third of them healthy; the others have each wear in turn, slowly, suddenly and in steps in turn, and are
    mended, if they are, after two thirds of that, every second one with a remark. The noise of every second rig is
    coloured. `unsteady`: supplies wander by 0.3 to 2 %, nobody writes down the oil's temperature of every second pair,
    and one wear has no name. `two`: another wear begins at another time, and grows in another way."""
    rigs, growths = [], get_args(Growth)
    wears = (*WEARS, UNNAMED) if unsteady else WEARS
    for k in range(number):
        random = np.random.default_rng([seed, k])
        worn = k - k // 3 - 1
        wear = None if k % 3 == 0 else wears[worn % len(wears)]
        begins = FEWEST + int(random.integers(max(1, sessions // 2 - FEWEST), max(2, 2 * sessions // 3 - FEWEST)))
        noise: Noise = "coloured" if k % 2 else "white"
        mended = begins + 2 * (sessions - begins) // 3 if mend and wear else None
        growth = growths[worn % 3] if wear else "slow"
        rig = MadeRig(seed * 1000 + k, wear, growth, begins, sessions, noise, mended, bool(worn % 2))
        if unsteady:
            supply = float(np.exp(random.uniform(*np.log(SUPPLY))))
            rig = replace(rig, supply=supply, thermometer=k // 2 % 2 == 0)
        if two and wear:
            other, way = wears[(worn + 3 + worn // len(wears)) % len(wears)], growths[(worn + 1) % 3]
            later = FEWEST + int(random.integers(1, max(2, sessions - FEWEST - 2)))
            rig = replace(rig, beside=replace(rig, wear=other, growth=way, begins=later))
        rigs.append(rig)
    return rigs


def write_sessions(rig: MadeRig, scene: Scene, folder: Path) -> list[Mapping[str, float]]:
    """A folder of dated sessions; the temperature is in each one's campaign.toml. The true numbers of each."""
    random = np.random.default_rng([rig.seed, 1])
    truths = []
    for session in range(rig.sessions):
        day = FIRST_DAY + timedelta(days=WEEK * session)
        warmer = SEASON * np.sin(2 * np.pi * WEEK * session / 365.25) + DAILY * random.standard_normal()
        numbers = {name: value * (1 + PER_KELVIN.get(name, 0.0) * warmer) for name, value in scene.true.items()}
        numbers["Ps"] *= 1 + rig.supply * random.standard_normal()
        numbers, mix = worn(rig, numbers, session)
        louder = float(np.exp(NOISIER * random.standard_normal()))
        plan = CampaignPlan(rig.seed * 1000 + session, "single", noise=rig.noise)
        extra = {"session": {"date": day.isoformat()}}
        if rig.thermometer:
            extra["session"]["oil_temperature"] = f"{40 + warmer:.1f} degC"
        if session == rig.mended and rig.said:
            extra["session"]["remark"] = "repaired"
        written_records(plan, scene, numbers, mix, louder, folder / day.isoformat(), extra)
        for part in rig.parts:
            if part.wear and part.wear.sensor:
                _rescale(folder / day.isoformat(), part.wear.sensor, 1 + part.share(session) * part.wear.most)
        truths.append(numbers)
    return truths


def worn(rig: MadeRig, numbers: Mapping[str, float], session: int) -> tuple[dict[str, float], Mix]:
    """The rig's numbers, and its effects with theirs, as far as it has worn in a session."""
    own, mix = dict(numbers), Mix()
    for part in rig.parts:
        wear, share = part.wear, part.share(session)
        if wear is None or share == 0.0 or wear.sensor:
            continue
        cause = wear.cause
        if cause is None:
            own[wear.name] *= 1 + share * (wear.most - 1)
        else:
            mix[cause] = {n.name: n.typical if n.off is None else n.off + share * wear.most * (n.typical - n.off)
                          for n in cause.effect.numbers}  # fmt: skip
    return own, mix


def _rescale(folder: Path, sensor: str, factor: float) -> None:
    """Make a sensor read so many times what it read."""
    for file in folder.glob("*.csv.gz"):
        with gzip.open(file, "rt", encoding="utf-8") as lines:
            head, *rows = lines.read().splitlines()
        column = [cell.split(" ")[0] for cell in head.split(",")].index(sensor)
        cells = [row.split(",") for row in rows]
        for row in cells:
            row[column] = f"{factor * float(row[column]):.7g}"
        with gzip.open(file, "wt", encoding="utf-8") as lines:
            lines.write("\n".join([head, *(",".join(row) for row in cells)]) + "\n")
