"""Closed loops, and every number that is measured on one.

sampled_loop, guarded_controller    a sampled controller on the plant, behind the rig's limits; it and its guard alone
compiled_loop, compiled_controller, sensors    the same, compiled; what a rig's sensors say
guard_numbers             a rig's numbers for the guard's rules, and what a leg of a platform carries
faults, fault_trial       faults, and the loop in which one begins; one from each of three moments, what they came to
scenarios, reach          what a loop is asked for, with the limits of its goals; whether a rig can do it; recorded ones
capability, trajectories    what a rig can give a motion; motions from rest to rest
rig_variations            on which rigs, known how well, with which delay and noise
step_metrics, metrics, rows    step metrics, each declared once; these and the margins as one row; spread over rigs
sampled_lanes, open_loops, margins    sampled plants, one or many; loops on them over frequency; their poles and margins
limit, tracking_limit     the soonest that an optimiser settles a known rig, the nearest that it follows
overshoots                overshoot of a position loop by what the design did not know
describing_function, sine_margins    closed-loop frequency response by stepped sine; margins by it
stiffness_and_noise       dynamic stiffness; RMS of the command from sensor noise
run_numbers               energy from the supply, force error of a specimen's moving far end, time to compute, of a run
batch, lane_laws          loops of laws on many plants at once
learning, repeated_record    a drive file learned by repeating a record, on one plant or on many at once
sines                     amplitude, phase and harmonics of sines; the controller that corrects them
designed_inverse          an inverse before a loop; a loop that closes through its reference
drive_simulation, standard_records    what a rig's drive plays, in simulation first, clear of the rig's limits
automatic                 a controller by rules from small moves, without a model
tuning/                   the search for a controller's numbers
robustness/               every controller on thousands of drawn plants
performance/              what a rig can do: envelopes over frequency, what a drive file takes, sizing
platform/                 a platform on six jacks: its loops, transfers, steps, and where it can go
plant_lanes, envelope, hard_goals    many plants; those that a loop has to hold on; goals to meet there, on the hardest
envelope_row              a controller over the envelope as one row; which controller to take of several
"""

import lazy_loader

# A scenario need not wait for the engine.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
