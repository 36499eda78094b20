"""`jackbench commission RIG --at udp://HOST:PORT`: from a datasheet to a controller that is verified on the live rig.

options      what it is asked
relay        a relay whose command grows until the jack moves: small moves of any rig
looks        the rig at rest and in small moves: is it what the datasheet says, as far as that shows at once?
automatic    a controller by rules, from these moves alone: what any model has to beat
motions      records that the worst of all plants still takes
designs      a controller searched for a rig and what is uncertain of it
verify       scenarios played on the rig, measured beside predicted
study        the whole way, and commission.json
page         the report
"""
