"""Closed loops, and every number that is measured on one.

sampled_loop, guard       a sampled controller on the plant, behind the rig's limits
guarded_controller, compiled_controller    a controller with its guard by itself, in Python and compiled
guard_numbers, carried    a rig's numbers for the guard's rules; what a leg of a platform carries
faults                    faults, and the loop in which one begins
fault_trial                  one fault in one loop, from one of three moments; what faults came to
compiled_loop, sensors    the same, compiled; what a rig's sensors say
scenarios, reach          what a loop is asked for, and whether a rig can do it
foreseen                  whether a motion stays clear of a rig's limits, by what it does in simulation
capability, trajectories, own_references    what a rig can give a motion; motions from rest to rest; recorded ones
rig_variations, conditions   on which rigs, known how well, with which delay and noise
step_metrics, rows        step metrics; these and the margins as one row
sampled_lanes, open_loops, margins    sampled plants, one or many; loops on them over frequency; their poles and margins
limit, tracking_limit     the soonest that an optimiser settles a known rig, the nearest that it follows;
                          limit_task is what both share
rig_spread                the rows of a controller over a set of rigs: least, most, and where it fails
overshoots                overshoot of a position loop by what the design did not know
describing_function, sine_points, sine_margins    closed-loop frequency response by stepped sine; margins by it
stiffness_and_noise       dynamic stiffness; RMS of the command from sensor noise
energy, moving_end        energy from the supply; force error of a specimen's moving far end
compute_time              how long a controller computes
batch, lane_laws    loops of laws on many plants at once
learning, repeated_record    a drive file learned by repeating a record
lane_learning, repeated_lanes    the same on many plants at once
sines                     amplitude, phase and harmonics of sines; the controller that corrects them
designed_inverse, outer_loop    an inverse before a loop; a loop that closes through its reference
drive_simulation, excitation_design, standard_records    what a rig's drive plays, in simulation first
automatic                 a controller by rules from small moves, without a model
tuning/                   the search for a controller's numbers
robustness/               every controller on thousands of drawn plants
performance/              what a rig can do: envelopes over frequency, what a drive file takes, sizing
platform/                 a platform on six jacks: its loops, transfers, steps, and where it can go
plant_lanes, envelope, hard_goals, hardest, limits    many plants; those that a loop has to hold on; goals to meet there
envelope_row, choice      a controller over the envelope as one row; which controller to take of several
"""

import lazy_loader

# A scenario need not wait for the engine.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
