"""What a rig can do: the largest sines by each of its bounds, what a loop follows of them, what a drive file takes.

carried     what a jack or an axis of a platform carries: travel and force per unit of its motion, over frequency
bounds      opening, chamber pressures and flow that a motion takes of the main lands; the largest sine at each
            frequency, by stroke, speed, force, supply, flow, valve, command rate, pump
reached     whether the engine reaches a sine by a command that is learned; the part of it that a loop follows, played
drive       what a drive file takes: opening, flow, power, heat; an accumulator for a pump; which valves and pumps of a
            catalogue do it, and by which limit the others fail
"""
