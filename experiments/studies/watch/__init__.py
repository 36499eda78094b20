"""`python -m experiments.studies.watch`: how well is a watch right, on made rigs over months, whose wear is known.

options     what it is asked
made_rig    rigs over months: oil, supply and noise wander, and one wear grows, or none
healthy     years of healthy rigs, drawn from what a real one's sessions tell: how often there is an alarm
courses     wears that are drawn, to ask how often a forecast's interval holds
study       each made rig watched, and what was told beside the truth
page        all of it as a report
"""
