"""What the commands compute: a configuration in, metrics, tables and a report page out."""

from ..common.outcome import Outcome, Progress, Stage
from .automatic import run_automatic
from .automatic_config import AutomaticConfig
from .corrector import run_corrector
from .options import Config, CorrectorConfig, PaperConfig, PlatformConfig
from .paper import run_paper
from .platform_study import run_platform_study
from .steps import run_steps


def run_any(config: Config, stage: Stage, progress: Progress) -> Outcome:
    """The study that an experiment file asks for."""
    if isinstance(config, PaperConfig):
        return run_paper(config, stage, progress)
    if isinstance(config, CorrectorConfig):
        return run_corrector(config, stage, progress)
    if isinstance(config, PlatformConfig):
        return run_platform_study(config, stage, progress)
    if isinstance(config, AutomaticConfig):
        return run_automatic(config, stage, progress)
    return run_steps(config, stage, progress)
