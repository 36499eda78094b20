"""The answer of a trace as one object: the sentence, the ranking, the rig as found, and the report."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import Any

from ...identify.trace.findings import Trace
from ...rigs.rig import Rig
from ..common.outcome import Answer, Outcome, leave
from ..common.run_folder import open_run

_SHOWN = 5  # lines of the ranking in a repr


@dataclass(frozen=True, eq=False)
class TraceAnswer(Answer):
    """What a campaign says of the rig's model: `str()` is the sentence that `jackbench trace` prints.

    `rig` is the rig as found: its fitted numbers and the effects that were added, with sources. `trace` holds the fits,
    `outcome` the report, `identity` what says that two traces are the same one. The properties are the keys of
    trace.json.
    """

    trace: Trace = field(repr=False)
    rig: Rig
    outcome: Outcome = field(repr=False)
    identity: Mapping[str, Any] = field(repr=False)

    @property
    def verdict(self) -> str:
        """ "named", "tied", "incomplete", "unknown" or "none"."""
        return self.outcome.metrics["verdict"]

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects that the model lacks, best first; none where the verdict is "unknown" or "none"."""
        return tuple(self.outcome.metrics["effects"])

    @property
    def equation(self) -> str | None:
        """The equation in which the residual sits; None for "none"."""
        return self.outcome.metrics["equation"]

    @property
    def ranking(self) -> list[dict[str, Any]]:
        """One row a fitted effect, best first: effect, formula, explained (share of the misfit), parameters.

        Parameters are {"Fc [N]": [value, low, high]}, 95 %.
        """
        return self.outcome.metrics["ranking"]

    @property
    def chi2(self) -> Mapping[str, float | None]:
        """Mean of (error / sigma)^2 on held-out records, "before" and "after"; 1 is the noise floor."""
        return self.outcome.metrics["chi2"]

    @property
    def rms(self) -> Mapping[str, Mapping[str, float | None]]:
        """{"pa [bar]": {"before", "after", "floor"}} of every measured signal, on held-out records."""
        return self.outcome.metrics["rms"]

    @property
    def sentence(self) -> str:
        """The answer in a few plain sentences."""
        return self.outcome.page.verdict

    def report(self, folder: str | Path, force: bool = False) -> Path:
        """Write the run folder of `jackbench trace` (report.html, trace.json, rig.toml ...); the path of the report.

        Raises InputError where `folder` exists already, unless `force`.
        """
        folder = Path(folder)
        with open_run(folder, self.identity, force) as run:
            leave(run, self.outcome, self.identity)
        return folder / "report.html"

    def __str__(self) -> str:
        return self.sentence

    def __repr__(self) -> str:
        rows = [
            f"  {_percent(row['explained']):>7}  {row['effect']} ({row['formula']})" for row in self.ranking[:_SHOWN]
        ]
        return "\n".join([self.sentence, *rows])

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td>{_percent(row['explained'])}</td><td>{escape(row['effect'])}</td>"
            f"<td>{escape(row['formula'])}</td><td>{escape(_numbers(row['parameters']))}</td></tr>"
            for row in self.ranking
        )
        head = "<tr><th>explained</th><th>effect</th><th>formula</th><th>numbers, 95 %</th></tr>"
        return f"<p>{escape(self.sentence)}</p>" + (f"<table>{head}{rows}</table>" if rows else "")


def _percent(share: float) -> str:
    return f"{100 * min(share, 1.0):.1f} %"


def _numbers(parameters: Mapping[str, list[float | None]]) -> str:
    """ "Fc = 60 N (58 to 62), ..."."""
    shown = []
    for label, (value, low, high) in parameters.items():
        name, unit = label.rstrip("]").split(" [")
        interval = "" if low is None or high is None else f" ({low:.3g} to {high:.3g})"
        shown.append(f"{name} = {'?' if value is None else f'{value:.3g}'} {unit}{interval}")
    return ", ".join(shown)
