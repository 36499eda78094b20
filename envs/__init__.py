"""Gymnasium environments of the jack: importing this package registers them.

registration     the names: JackPosition-v0, JackForce-v0
single, vector   one jack, and many side by side; thin shells over the core
core             the episodes of N lanes: reset, period, reward, end
lone             a core of one lane, in plain numbers while nothing ends
timeline         what an episode is given in advance: rig numbers, start, reference, specimen, sensor noise
lane_guard       workbench.guard over lanes
sensing, sight   what the sensors say; what an observation holds, with its full scales
drives           commands that arrive late
physics          advance and observe of N lanes: the only place that knows an engine
task, table      a task's TOML, read strictly; the bundled ones are in tasks/
references       the families that references are drawn from
"""

from .registration import register

register()

__all__ = ["register"]
