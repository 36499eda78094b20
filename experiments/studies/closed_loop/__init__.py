"""How often the numbers of a closed loop lie within their intervals, where reference and position alone were recorded.

study    drawn rigs in drawn loops, played and fitted
"""
