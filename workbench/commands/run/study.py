"""What the commands compute: a configuration in, metrics, tables and a report page out."""

from collections.abc import Callable

from ..common.outcome import Outcome, Progress, Stage
from .automatic import run_automatic
from .automatic_config import AutomaticConfig
from .config import Config, CorrectorConfig, PaperConfig, PlatformConfig
from .corrector import run_corrector
from .paper import run_paper
from .platform_study import run_platform_study
from .steps import run_steps

__all__ = ["Outcome", "Progress", "Stage", "study_of"]


def study_of(config: Config) -> Callable[[Stage, Progress], Outcome]:
    """The study that an experiment file asks for."""
    if isinstance(config, PaperConfig):
        return lambda stage, progress: run_paper(config, stage, progress)
    if isinstance(config, CorrectorConfig):
        return lambda stage, progress: run_corrector(config, stage, progress)
    if isinstance(config, PlatformConfig):
        return lambda stage, progress: run_platform_study(config, stage, progress)
    if isinstance(config, AutomaticConfig):
        return lambda stage, progress: run_automatic(config, stage, progress)
    return lambda stage, progress: run_steps(config, stage, progress)
