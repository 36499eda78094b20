from .base.errors import InputError as InputError
from .base.signals import SIGNALS as SIGNALS
from .base.trust import trust as trust
from .base.units import from_si as from_si, quantity as quantity, to_si as to_si
from .control.controller_spec import ControllerSpec as ControllerSpec
from .control.controller_type import controller as controller
from .control.fractional import (
    FractionalTransferFunction as FractionalTransferFunction,
    fit_fractional as fit_fractional,
)
from .control.protocol import Controller as Controller, design_numbers as design_numbers, number as number
from .engine import Engine as Engine, Trajectory as Trajectory
from .linear import (
    Equilibrium as Equilibrium,
    discretise as discretise,
    equilibrium as equilibrium,
    linearise as linearise,
    nonlinear_system as nonlinear_system,
)
from .linear.frequency_response import stepped_sine as stepped_sine
from .loop.rig_variations import RIG_SET as RIG_SET, variation as variation, with_delay as with_delay
from .loop.scenarios import SCENARIOS as SCENARIOS, Scenario as Scenario
from .notebook.benchmark import Benchmark as Benchmark, benchmark as benchmark
from .notebook.closed_loop import ClosedLoop as ClosedLoop
from .notebook.commands import (
    bench as bench,
    capability as capability,
    coefficients as coefficients,
    commission as commission,
    compare as compare,
    drive as drive,
    excite as excite,
    fmu as fmu,
    force_test as force_test,
    frequency as frequency,
    import_ as import_,
    jack_model as jack_model,
    learn as learn,
    limit as limit,
    new_rig as new_rig,
    record as record,
    spread as spread,
    time as time,
    train as train,
    valve_test as valve_test,
    watch as watch,
)
from .notebook.judgements import faults as faults, inverse as inverse, robustness as robustness, sines as sines
from .notebook.search import tune as tune
from .notebook.studies import (
    fit as fit,
    frequency_response as frequency_response,
    plan as plan,
    residual as residual,
    retune as retune,
    run as run,
    trace as trace,
)
from .notebook.time_response import TimeResponse as TimeResponse
from .plant import Plant as Plant, build as build, build_force_port as build_force_port
from .plant.effects import Effect as Effect, known_effects as known_effects
from .records import Campaign as Campaign, Record as Record, load_campaign as load_campaign, read_record as read_record
from .records.frequency_sheet import read_sheet as read_sheet
from .report import Curve as Curve, Figure as Figure, Panel as Panel, Table as Table
from .rigs.linear_system import linear_plant as linear_plant
from .rigs.rig import Rig as Rig
from .rigs.rig_file import load_rig as load_rig, save_rig as save_rig
