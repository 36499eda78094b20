"""What a rig is: its numbers with units, sources and bounds.

rig, number, sensor    a rig, its numbers and its sensors
rig_file, rig_table    its TOML file, read and written; the bundled ones are beside this file
shipped     the names of the bundled rigs and platforms
schema, together    the numbers that every rig has, and what they have to be to each other
oil         what its oil is where its file does not say
valve/      the kinds of valve: their numbers, spool loops, slots and stages
inner_loop  the loop of somebody else's controller, whose reference is the rig's command
driven      a campaign with what drives its rig as the command
jack, load  the kinds of jack and of load
line_valve  a valve in the lines that lets oil out of the jack only when it is opened
limited     the signals that stay within limits, and whose each limit is
tolerances  how far a number may be off where its datasheet does not say
shut_off    a valve in the lines that the guard closes on a trip
sampling    what becomes of a reading and of a command at a sampling instant, of numbers, arrays and graphs
summary     a rig in a few lines, and as a table in a notebook
datasheet, datasheet_keys, datasheet_rules    a rig from what makers say; what they have to say, and what cannot be
platform/   a platform on six jacks, its file and its kinematics
linear_rig, linear_form, linear_signals, linear_file, linear_sheet, linear_system    a linear plant of the user's own in
            the place of a rig: what it is, how its model is written, what its outputs are, its file, a measured
            response, and what python-control has
"""

from .number import Number
from .rig import Rig
from .rig_file import bundled, load_rig, save_rig
from .sensor import Sensor

__all__ = ["Number", "Rig", "Sensor", "bundled", "load_rig", "save_rig"]
