"""Closed loops, and every number that is measured on one.

sampled_loop, guard       a sampled controller on the plant, behind the rig's limits
compiled_loop, sensors    the same of a linear law, compiled; what a rig's sensors say
scenarios, rig_variations    what a loop is asked for, and on which rigs
step_metrics, margins, rows    step metrics; poles, sensitivity and margins; both as one row
batch, lane_metrics       many plants at once, a lane each, and their step metrics
describing_function       closed-loop frequency response by stepped sine
batch, lane_metrics, lane_margins    loops of one law on many plants at once
stiffness_and_noise, overshoot_spread, compute_time    what a loop bears and costs
"""
