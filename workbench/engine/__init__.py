"""The engine: a plant, a command held over each control period, and an adaptive implicit step, all one graph.

engine         simulation of one trajectory or of batches; which back end runs is its affair: only `compiled` needs a
               compiler, and imports it when used; large graphs are kept for the next start
trajectory     what a run gives: signals by name, with units
sampled_law    a sampled law inside the compiled run of a plant; instant, what happens at each instant, of one jack or
               of the legs of a platform; sampled_code, its machine code
guard_rules    what a guard concludes from readings and lets through, as a graph; guard_motion, what the readings say of
               the motion; guard_shape, its places
staggered      force ports beside a program that integrates the mechanics
delay_line     commands on their way to a plant whose drive is late
rosenbrock     the implicit step and its adaptive length as a graph, with the solver of its linear systems
collocation    commands that are found, not given: states and commands on a mesh; fastest, the fastest motion to a
               place; nearest, the motion that follows a reference nearest
tangent        steps with their exact derivatives along a direction
compiled       machine code: tape and emit turn the graph into vector code of lanes, codegen and driver the loop around
               it (written with scalars, on the jobs of a run), vector_math the functions that LLVM lacks; object_cache
               keeps what was compiled; kernel, kernel_code and kernel_graph, loops that graphs call
interpreter    the same by CasADi alone; lazy_casadi, which is imported when the first graph is built
buffered       small graphs evaluated in fixed places
floor          least time of an attempt: that of its divisions and roots
peers          public solvers that the engine is measured against
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
