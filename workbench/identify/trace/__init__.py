"""From a residual to the effect that the model lacks.

tracer              a whole trace: a search, then its verdict
context             its problem, library and stages
search, refits      effects one after the other; one pass: shortlist, refit, judge
steps               which step of how many, and the time left
workers             processes that share scores and refits
verdict             what held-out records make of it
localise, locate    in which equation the residual sits
cuts                what measured signals say of it by themselves, block by block
kalman              the filter and smoother that tell it
score, shortlist    which effects could explain it, without a refit
information, told   what records would tell, before they are made; what those of a closed loop show
record_gain         what a further record adds: effects told apart, numbers told
problem             which records are fitted, which select, which judge
refit, rule         a fit with one effect more, and the rule that names one
considered          pinned numbers that are not exactly known, in the intervals of the others
left_out            fits made again without parts of free runs
follow              where a refit starts, numbers following a finite effect; a fit by secants, where a loop may hunt
short_windows       the fit of such an effect that harms wherever it starts
pairs, joint        two effects at once: by the score test, and refitted together
several             which of several missing effects comes first
batches, batch_refits    all of them at once, where records are run through: added by the batch, taken out one by one
in_place            what would do in the place of one of these
shape               what an unknown looks like
reshape, shapes, samples    the rig's own shape, learned: one reshaping, the search, where the campaign was
findings, stored    the answer, and fits as a run keeps them

    from workbench.identify.trace import estimation_problem, trace
    answer = trace(estimation_problem(campaign, rig), known_effects(), stage, print)
    answer.verdict, [effect.candidate.effect.name for effect in answer.effects]
"""

import lazy_loader

# An estimation problem need not wait for the whole tracer.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
