"""The column of each signal, with a reason; where two columns or two signals are as likely, none is taken."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from ...base.signals import SIGNALS
from ...base.units import converts, from_si
from ...records.columns import ColumnMap
from ...records.foreign.unit_names import name_of
from ...records.foreign.vocabulary import SURE, VAGUE, is_filtered, strengths
from ...rigs.rig import Rig
from .conversion import Conversion, conversion
from .summary import ColumnSummary

GUESSED = ("t", "command", "reference", "current", "spool", "pa", "pb", "load_pressure", "supply", "position",
           "velocity", "acceleration", "force")  # fmt: skip
_ALONE = ("position", "velocity", "acceleration", "force")  # told by their unit, where one column alone has it
_SEVERAL = 0.20  # share of missing cells between others that the records' reader refuses
_MOST = 0.50  # of all: less tells no span that all share
CLEAR, LIKELY = "clear", "likely"


@dataclass(frozen=True)
class ColumnGuess:
    """What a column is taken for: `signal` is None where it is left out, and `reason` says why."""

    column: ColumnSummary
    signal: str | None
    confidence: str
    reason: str
    conversion: Conversion | None = None
    suggested: str = ""

    @property
    def mapping(self) -> ColumnMap:
        """The column's entry in [signals]."""
        assert self.conversion is not None
        how = self.conversion
        plain = how.scale == 1.0 and how.offset == 0.0 and how.to == how.unit
        if plain:
            return ColumnMap(self.column.cell, how.unit, between=self.column.between)
        return ColumnMap(self.column.cell, how.unit, how.scale, None, how.to, how.offset, between=self.column.between)

    def turned(self, about: float, reason: str) -> "ColumnGuess":
        """With the other sign about a value [SI], which stays."""
        assert self.conversion is not None
        assert self.signal is not None
        shift = 2 * float(from_si(about, self.conversion.to, SIGNALS[self.signal].si)) - self.conversion.offset
        how = replace(self.conversion, scale=-self.conversion.scale, offset=float(f"{shift:.6g}") + 0.0)
        return replace(self, conversion=how, confidence=LIKELY, reason=f"{self.reason}; {reason}")

    def left_out(self, reason: str) -> "ColumnGuess":
        """Left out after all."""
        return replace(self, signal=None, confidence="", reason=reason, suggested=self.signal or "")


@dataclass(frozen=True)
class _Candidate:
    column: ColumnSummary
    signal: str
    strength: int
    how: Conversion

    @property
    def rank(self) -> tuple[int, bool, bool]:
        return self.strength, self.how.is_sure, not is_filtered(name_of(self.column.cell))


def guess_columns(columns: Sequence[ColumnSummary], rig: Rig) -> list[ColumnGuess]:
    """A guess a column, in the order of the columns."""
    refusals: dict[str, str] = {}
    candidates = [each for column in columns for each in _candidates(column, rig, refusals)]
    candidates += _by_unit_alone(columns, candidates, rig, refusals)
    chosen, ambiguous = _assigned(candidates)
    return [_guess(column, chosen, ambiguous, candidates, refusals) for column in columns]


def _candidates(column: ColumnSummary, rig: Rig, refusals: dict[str, str]) -> list[_Candidate]:
    """The signals that a column's name means, of which its unit and range can be."""
    candidates = []
    for signal, strength in strengths(name_of(column.cell)).items():
        how = conversion(column, signal, rig)
        if isinstance(how, str):
            refusals.setdefault(column.cell, f"named like {signal}, but {how}")
        elif column.gaps > _SEVERAL or column.missing > _MOST:
            refusals[column.cell] = f"named like {signal}, but {column.missing:.0%} of its cells are empty"
        elif strength > VAGUE or how.is_sure or column.unit is not None:
            candidates.append(_Candidate(column, signal, strength, how))
        else:
            refusals.setdefault(column.cell, f"may be {signal}: neither name nor unit says so clearly")
    return candidates


def _by_unit_alone(
    columns: Sequence[ColumnSummary], candidates: Sequence[_Candidate], rig: Rig, refusals: dict[str, str]
) -> list[_Candidate]:
    """Signals without a candidate whose unit one nameless column alone has; and the one clock of nameless columns."""
    named, signals = {each.column.cell for each in candidates}, {each.signal for each in candidates}
    nameless = [column for column in columns if column.cell not in named and not strengths(name_of(column.cell))]
    alone = []
    for signal in [signal for signal in _ALONE if signal not in signals]:
        having = [c for c in nameless if c.unit not in (None, "1", "%") and converts(c.unit or "1", SIGNALS[signal].si)]
        same = [c for c in columns if c.unit not in (None, "1", "%") and converts(c.unit or "1", SIGNALS[signal].si)]
        if len(having) == len(same) == 1 and not isinstance(how := conversion(having[0], signal, rig), str):
            alone.append(_Candidate(having[0], signal, VAGUE, replace(how, reason=f"the only column in {how.unit}")))
    clocks = [column for column in nameless if column.unit == "s" and column.step is not None]
    if "t" not in signals and len(clocks) == 1 and not isinstance(how := conversion(clocks[0], "t", rig), str):
        alone.append(_Candidate(clocks[0], "t", VAGUE, how))
    return alone


def _assigned(candidates: Sequence[_Candidate]) -> tuple[dict[str, _Candidate], dict[str, str]]:
    """The candidate of each column that has one, by cell; and why the ambiguous ones are none."""
    chosen: dict[str, _Candidate] = {}
    ambiguous: dict[str, str] = {}
    left = sorted(candidates, key=lambda each: each.rank, reverse=True)
    taken: set[str] = set()
    while left:
        rank = left[0].rank
        level = [each for each in left if each.rank == rank]
        clocks = [each for each in level if each.signal == "t"]
        level = [each for each in level if each not in clocks[1:]]  # of clocks any one does: the first
        for each in level:
            rivals = [o for o in level if o.signal == each.signal and o.column.cell != each.column.cell]
            also = [o for o in level if o.column.cell == each.column.cell and o.signal != each.signal]
            if rivals:
                others = ", ".join(f'"{rival.column.cell}"' for rival in rivals[:3])
                ambiguous[each.column.cell] = f"{each.signal} may also be {others}"
            elif also:
                ambiguous[each.column.cell] = f"may be {each.signal} or {also[0].signal}"
            else:
                chosen[each.column.cell] = each
        taken |= {each.signal for each in level}
        settled = {each.column.cell for each in level}
        left = [each for each in left if each.signal not in taken and each.column.cell not in settled]
    return chosen, ambiguous


def _guess(
    column: ColumnSummary,
    chosen: Mapping[str, _Candidate],
    ambiguous: Mapping[str, str],
    candidates: Sequence[_Candidate],
    refusals: Mapping[str, str],
) -> ColumnGuess:
    mine = [each for each in candidates if each.column.cell == column.cell]
    suggested = mine[0].signal if mine else next(iter(strengths(name_of(column.cell))), "")
    if candidate := chosen.get(column.cell):
        named = {SURE: "name", VAGUE: "vague name"}.get(candidate.strength, "name")
        by_name = f"{named}, " if strengths(name_of(column.cell)) else ""
        clear = candidate.strength > VAGUE and candidate.how.is_sure
        confidence = CLEAR if clear else LIKELY
        return ColumnGuess(column, candidate.signal, confidence, f"{by_name}{candidate.how.reason}", candidate.how)
    if column.cell in ambiguous:
        return ColumnGuess(column, None, "", ambiguous[column.cell], None, suggested)
    if mine:
        holder = next(each for each in chosen.values() if each.signal == mine[0].signal) if any(
            each.signal == mine[0].signal for each in chosen.values()) else None  # fmt: skip
        better = f'"{holder.column.cell}" is more clearly' if holder else "other columns may be"
        return ColumnGuess(column, None, "", f"{better} {mine[0].signal}", None, suggested)
    reason = refusals.get(column.cell, "neither name nor unit says what it is")
    return ColumnGuess(column, None, "", reason, None, suggested)
