"""The door for Python: loops, searches and campaigns as objects that show themselves in a notebook.

closed_loop       a rig with a controller: steps, references, margins, frequency response, poles
time_response, stability, closed_loop_bode    what those return
inverse           a filter of the reference that undoes a loop
search            tune: the numbers of a loop's controller searched
benchmark         loops beside each other on a set of rigs
loops             loops that are judged together
judgements        robustness, faults, sines and inverse, of loops
studies           experiments and campaigns: run, residual, fit, trace, plan, retune
commands          every other command of the command line, by its name and options
door              functions that take a rig for a plant, and say in one line what they want
"""
