"""Frequency-response sheets as records: what a model lacks, from a maker's curves.

problem     which points are fitted, and which judge
model       stepped sines on the bench of the sheets
fit         numbers that fit them
element     what one linear element adds to a response
remainder   where something is left, and the element that takes it away
shortlist   which effects could explain what is left
tracer      fit, gate, shortlist, refit, decide
"""
