"""`jackbench watch FOLDER`: a rig over months: which number or effect changes, since when, and what it costs a loop.

options       what it is asked
retuning      what the controller, searched anew on the rig as it is, would give back
study, page   all of it for one rig; the page that is looked at every week
rigs          several rigs, what needs attention first
"""
