"""Views of a plant: pure functions to its equilibria, its linear models and its python-control system.

operating_point           equilibrium: at rest, at a constant command, at a constant speed
equilibria                operating points of many plants at once
linearisation, sampling   linear models about an operating point, continuous and as a sampled loop sees them
platform_modes            a platform under gravity in any pose, its modes, what decouples it
nonlinear, block_diagram  the plant as a nonlinear system; the paper's model of the three-stage valve
frequency_response        by stepped sine, and of a linear model
crossings                 where a sampled curve passes a level; corner frequencies
state_space, interconnect    linear systems inside: matrices with named signals, put together by these names

Names are loaded when they are used. Each function that returns a system of python-control imports it when called: an
equilibrium need not wait for it.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
