from .describing_function import closed_loop_sine as closed_loop_sine
from .margins import LinearLoop as LinearLoop, closed_poles as closed_poles, linear_loop as linear_loop
from .overshoots import overshoot_spread as overshoot_spread
from .rig_variations import (
    RIG_SET as RIG_SET,
    Conditions as Conditions,
    variation as variation,
    with_delay as with_delay,
)
from .rows import (
    LinearLoops as LinearLoops,
    LoopSetup as LoopSetup,
    judge as judge,
    linear_loops as linear_loops,
    loop_setup as loop_setup,
    play as play,
    row as row,
    spread_over_rigs as spread_over_rigs,
)
from .run_numbers import (
    SupplyEnergy as SupplyEnergy,
    computing as computing,
    error_per_speed as error_per_speed,
    supply_energy as supply_energy,
)
from .sampled_loop import LoopRun as LoopRun, SampledLoop as SampledLoop
from .scenarios import SCENARIOS as SCENARIOS, Scenario as Scenario
from .step_metrics import (
    cavitation_time as cavitation_time,
    iae as iae,
    overshoot as overshoot,
    peak_deviation as peak_deviation,
    residual_oscillation as residual_oscillation,
    rise_time as rise_time,
    saturated_time as saturated_time,
    settling_time as settling_time,
    steady_state_error as steady_state_error,
)
from .stiffness_and_noise import command_noise as command_noise, dynamic_stiffness as dynamic_stiffness
