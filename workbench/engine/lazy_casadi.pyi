from casadi import *  # noqa: F403
