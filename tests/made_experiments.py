"""Parts of small experiments that several tests write."""

P_DP = """[controllers.p-dp]
use = "controllers.p:P"
gain = "3 1/m"
[[controllers.p-dp.compensators]]
use = "controllers.pressure:PressureFeedback"
gain = "1.6e-4 1/bar"
corner = "0.25 Hz"
"""
