"""How often the answers about a closed loop are right, where reference and position alone were recorded.

study    drawn rigs in drawn loops, played and fitted: their numbers within their intervals
names    the same with an effect that nobody declared, traced
press    the figures of a press whose recordings the project has not
"""
