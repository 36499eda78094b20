"""The wrench on a platform's payload: what its legs say that they give it, beside what its motion asks for.

motion       pose, velocity and acceleration of a platform by what its legs measured
balance      the two wrenches at each time, and what each number of the payload asks for
lines        a balance by frequency, and its noise at rest
fitted       the payload's numbers that close it best
candidates   what joints and payload may show, as wrenches
closed       a balance closed with some of these
search       which of these is missing, by the rule of a trace
rod          what a rod bears beside its load cell
leg_forces   forces of legs without load cells, by pressures and by the payload's motion
leg_cut      a leg as a jack under its force
"""
