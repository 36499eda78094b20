"""What a commissioning does at the live rig, and how it judges that.

relay        a relay whose command grows until the jack moves: small moves of any rig
dither       what frees a valve that stays open when its command is gone
looks        the rig at rest and in small moves: is it what the datasheet says, as far as that shows at once?
computing    how long it may compute
rig_time     what is played on the rig: recorded, kept, no longer than is allowed
allowed      the plants that bounds or recordings allow: each motion of any command is played on all of them first
motions      records that the worst of all plants still takes
designs      a controller searched for a rig and what is uncertain of it
verify       scenarios played on the rig, measured beside predicted
leading      the leading designs played on the rig, which decides
obstacles    what stands in the way of any controller, what it costs, what to mend or record
"""
