"""Control laws: what a controller is, and what designs are made of.

protocol               what a controller is
controller_spec, load_class    a controller of a config: its class, numbers and compensators
controller_type        the same for Python: a law called with its numbers
compensators           filters that stack on any controller
discrete_filter, second_order_sections, section_controller    sampled linear laws
linear_law             sampled linear laws as data, for compiled loops
jack_model, inner_loop    the jack as an outer controller sees it
kalman_observer, mpc_qp    what model-based controllers share
crone                  fractional design
export                 coefficients for a rig's own digital controller
"""
