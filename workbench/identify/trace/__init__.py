"""From a residual to the effect that the model lacks.

tracer              fit, gate, localise, shortlist, refit, decide, and again
localise, locate    in which equation the residual sits
score               which effects could explain it, without a refit
refit, rule         each fitted, and the rule that names one
shape               what an unknown looks like
findings, stored    the answer, and fits as a run keeps them
"""
