"""What recordings say of a rig.

data        noise floor, whiteness, measured frequency response
fit         windows, models with their slopes, and the fit of a rig's numbers
watch       a rig over months: what changes from session to session
trace       from a residual to the effect that the model lacks
found       what a fit or a trace has found, said in numbers
plan        records that do not exist yet, to be compared
wrench      from the wrench on a platform's payload to what its joints lack
sheet       from a maker's curves to the effect that the model lacks
columns     which column of a foreign recording is which signal
acceptance  sheets that a laboratory signs
datasheet   valves fitted to a maker's figures

    from workbench.identify import estimation_problem, fit_rig, noise_floor
    floor = noise_floor(load_campaign("experiments/sample"))      # sigma [SI] and kappa of every measured signal
    problem = estimation_problem(campaign, rig)                   # windows to fit, windows to judge by
    model_fit = fit_rig(problem)                                  # the rig's numbers that have bounds, fitted
"""

import lazy_loader

# A noise floor need not wait for the plant.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
