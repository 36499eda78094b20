from .delay_line import DelayLine as DelayLine, LaneDelays as LaneDelays, periods as periods
from .engine import Engine as Engine
from .jobs import Batch as Batch
from .trajectory import Trajectory as Trajectory
