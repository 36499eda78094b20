"""What a commissioning does at the live rig, and how it judges that.

relay        a relay whose command grows until the jack moves: small moves of any rig; a dither that frees a valve; is
             the rig at rest and in small moves what the datasheet says, as far as that shows at once?
growth       how fast that command may grow on a rig whose limits are tight
rig_time     what is played on the rig: recorded, kept, no longer than is allowed; how long may be computed
allowed      the plants that bounds or recordings allow: each motion of any command is played on all of them first, and
             records that the worst of them still takes
designs      a controller searched for a rig and what is uncertain of it
verify       scenarios played on the rig, measured beside predicted; of the leading designs it decides
obstacles    what stands in the way of any controller, what it costs, what to mend or record
"""
