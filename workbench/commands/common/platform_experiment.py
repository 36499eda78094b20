"""What experiments on a platform share: the platform, controllers on its legs or modes, steps, how they are judged."""

from ...base.table import ConfigTable
from ...control.controller_spec import ControllerSpec, controller_spec, read_numbers
from ...control.platform_controller import LEGS, Forward, PlatformSpec, Smoothing
from ...loop.platform.steps import AxisStep
from ...loop.rig_variations import Conditions
from ...rigs.platform import Platform, load_platform
from .declared import Experiment, ExperimentFile, declared, part
from .experiment import CONDITIONS, CONTROLLERS, read_conditions


def _platform(at: ExperimentFile) -> Platform:
    rig = at.asked.get("rig")
    return load_platform(rig) if rig else load_platform(at.top.text("rig"), at.path.parent)


def _controllers(at: ExperimentFile) -> tuple[PlatformSpec, ...]:
    if not at.tables:
        raise at.top.complaint("controllers", "no controllers; add a table [controllers.NAME]")
    return tuple(platform_controller(name, table, at.rig) for name, table in at.tables.items())


@declared
class PlatformExperiment(Experiment):
    """Controllers on a platform, and the conditions under which they are judged."""

    rig: Platform = part(_platform, {"rig": "a platform"})
    controllers: tuple[PlatformSpec, ...] = part(_controllers, CONTROLLERS)
    conditions: Conditions = part(read_conditions, CONDITIONS)

    @property
    def delay(self) -> float:
        """Computing delay [s]."""
        return 0.0 if self.conditions.ideal else self.rig.legs[0].rig.computing_delay.value


def read_steps(at: ExperimentFile) -> tuple[AxisStep, ...]:
    """The steps along axes under the key scenarios. Raises InputError with file and key."""
    names = at.top.words("scenarios", "heave-10mm")
    return tuple(at.top.about("scenarios", lambda name=name: AxisStep.named(name)) for name in names)


def platform_controller(name: str, table: ConfigTable, platform: Platform) -> PlatformSpec:
    """On every leg the controller of a table; or, with a list of `laws`, one on each mode. Raises InputError with file
    and key."""
    if "laws" not in table:
        own = table.replaced({key: entry for key, entry in table.values.items() if key != "smoothing"})
        spec = _checked(controller_spec(name, own), own, platform)
        return PlatformSpec(name, (spec,) * LEGS, smoothing=_smoothing(table))
    table.allow("laws", "smoothing", "command_map")
    laws: dict[int, tuple[ControllerSpec, Forward | None]] = {}
    for entry in table.tables("laws"):
        modes = entry.numbers("modes", "[1, 2]")
        own = entry.replaced({key: part for key, part in entry.values.items() if key not in ("modes", "forward")})
        spec = _checked(controller_spec(name, own), own, platform)
        forward = read_numbers(Forward, entry.table("forward")) if "forward" in entry else None
        for mode in modes:
            if mode not in range(1, LEGS + 1) or int(mode) in laws:
                raise entry.complaint("modes", f"each mode from 1, the slowest, to {LEGS} needs one law")
            laws[int(mode)] = spec, forward
    if len(laws) < LEGS:
        raise table.complaint("laws", f"each mode from 1, the slowest, to {LEGS} needs one law")
    ordered = [laws[i + 1] for i in range(LEGS)]
    forwards = tuple(forward for _, forward in ordered if forward)
    if len(forwards) not in (0, LEGS):
        raise table.complaint("laws", "give all laws a table forward, or none")
    command_map = _command_map(table, name) if "command_map" in table else None
    return PlatformSpec(name, tuple(spec for spec, _ in ordered), True, command_map, forwards, _smoothing(table))


def _smoothing(table: ConfigTable) -> Smoothing | None:
    return read_numbers(Smoothing, table.table("smoothing")) if "smoothing" in table else None


def _command_map(table: ConfigTable, name: str) -> ControllerSpec:
    """The map of the commands of the jacks: a compensator that maps a command."""
    part = table.table("command_map")
    spec = controller_spec(
        name, part.replaced({"use": "controllers.p:P", "gain": "1 1/m", "compensators": [part.values]})
    )
    return spec.compensators[0]


def _checked(spec: ControllerSpec, table: ConfigTable, platform: Platform) -> ControllerSpec:
    """A law of the position of a jack, with the signals that the legs measure."""
    law = spec.build(platform.period)
    if law.measures[0] != "position":
        raise table.complaint("use", f"controls the {law.measures[0]}; a platform's laws control the position")
    for signal in law.measures:
        if any(signal not in leg.rig.sensors for leg in platform.legs):
            raise table.complaint("use", f"needs the {signal}, which not all legs measure; declare a sensor")
    return spec
