"""The link: a rig on UDP, served from the plant or driven from the workbench.

datagrams     their bytes; hello, what a rig says of itself
bench         what is served: plant, sensors, ranges, limits
served_rig    a bench in service, period by period
rig_server    who may command it, and what it answers; paced, by its client or by the clock
pace          the clock's instants, and what an empty loop misses of them
opc_ua        both ends under the eyes of a SCADA panel
client        the workbench's end: greets, switches, commands; wire_loop, a controller there; course, what it plays,
              beside the same in simulation
joined, trips    a rig by the tighter of its file and its hello; why a motion ended at a limit
commissioning/    what a commissioning does at the rig, and how it judges that
"""
