"""A rig over months: what each session says of it, and what changes from session to session.

session_evidence    a session's fit, of a rig held to what healthy ones do, and how its errors answer to every axis
history             all sessions on common axes, and how a healthy rig wanders between them
changes             whether an axis changes, since when and until when; the limit of an alarm
smoothed            each axis over the sessions: a mean that goes with its changes, and the wander about it
known_then          what was known of each session when it was the newest
healthy_rate        how often a healthy rig would raise an alarm
naming              suspects fitted to sessions before and after a change
reader              each session's evidence, and suspects fitted to it, from the user's cache where it was read before
told                a change with its name, and the course of what is named
splitting           what to record so that names that look alike part
loop_costs          a tuned loop's margins and step on the rig of each session
forecast            when one of them passes its limit
"""
