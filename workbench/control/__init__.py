"""Control laws: what a controller is, and what designs are made of.

protocol               what a controller is
controller_spec, load_class    a controller of a config: its class, numbers and compensators, and whether it is one
controller_type        the same for Python: a law called with its numbers
compensators           filters and static maps that stack on any controller
law                    the one form of a law: two graphs, a start, numbers; and the controller that Python asks
shell, shells          what stands around a law, as graphs: filters, maps, plans, sines, load cells
measured_stiffness     force loops scaled by the stiffness that they measure
mode_law               mass, oil and velocity gain measured as a loop moves; a law scheduled by them
reference_plan         a motion planned of a reference, with the command for its flow
automatic_tuning       gains by rules from small moves, without a model
sine_control           amplitude, phase and harmonics of sines corrected as measured
second_order_sections  sampled linear laws
network, network_law   trained networks: arrays, their files, what they add to a law
piecewise_linear       schedules and maps of the command as graphs
jack_model, inner_loop    the jack as an outer controller sees it
linear_model           a linear plant of the user's own as its designs see it
kalman_observer, mpc_qp    what model-based controllers share
planned_step, planned_law    a predictive law: a sample of it, and the law
crone, fractional      fractional design; fractional systems as objects
platform_controller, platform_law    six laws on the legs or on the modes of a platform; as one graph
export/                laws for a rig's own digital controller
"""

import lazy_loader

# The protocol need not wait for any design.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
