"""`jackbench commission RIG --at udp://HOST:PORT`: from a datasheet to a controller that is verified on the live rig.

options      what it is asked
relay        a relay whose command grows until the jack moves: small moves of any rig
dither       what frees a valve that stays open when its command is gone
looks        the rig at rest and in small moves: is it what the datasheet says, as far as that shows at once?
transducers  an effect file: pressures that are read too large
automatic    a controller by rules, from these moves alone: what any model has to beat
computing    how long it may compute
rig_time     what is played on the rig: recorded, kept, no longer than is allowed
motions      records that the worst of all plants still takes
designs      a controller searched for a rig and what is uncertain of it
verify       scenarios played on the rig, measured beside predicted
leading      the leading designs played on the rig, which decides
rounds       what the records say, a controller for the rig as found, and whether that is enough
obstacles    what stands in the way of any controller, what it costs, what to mend or record
study        the whole way
results      commission.json, the controller as file, C and ST, the rig as found
page         the report
"""
