"""`jackbench watch FOLDER`: a rig over months: which number or effect changes, since when, and what it costs a loop.

options       what it is asked
reader        each session's evidence, and suspects fitted to it, from the user's cache where it was read before
told          a change with its name, and the course of what is named
splitting     what to record so that names that look alike part
loop_costs    a tuned loop's margins and step on the rig of each session
retuning      what the controller, searched anew on the rig as it is, would give back
forecast      when one of them passes its limit
study, page   all of it for one rig; the page that is looked at every week
rigs          several rigs, what needs attention first
"""
