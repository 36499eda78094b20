"""`jackbench live EXPERIMENT`: a page on this machine on which numbers are dragged, and the loop answers at once.

options     what it is asked
config      step, tune and bench experiments as loops to show
sliders     the numbers of controllers and of the rig that can be moved, with their ranges
plants      the rigs of the set, with the numbers that were moved
view        what a loop does there: margins, responses, steps, and what is out of the goals
after       what takes longer: the closed loop by sines, and hunting
limit       how soon anything could settle there, by a process of its own
session     requests of the page, and their answers
page        the page; assets has its script and its style
saved       the numbers as an experiment that `jackbench run` takes
"""
