"""Effects of pump drives in plain words."""

PUMP_EFFECT = {
    "sensor.zero": "the pressure sensors have another zero point",
    "pump.leakage": "the pump leaks",
    "pump.ripple": "the pump's flow pulsates",
    "hose.compliance": "the hoses give",
    "selector.delay": "the direction valves switch late",
    "selector.check": "a check valve keeps the pump from being driven back",
    "accumulator.line": "the accumulator's line throttles",
    "accumulator.stiffness": "the accumulator has another amount of gas",
    "motor.losses": "the motor loses torque",
    "load.buildup": "the load builds up over travel",
    "load.throttle": "the load brakes with its speed",
    "jack.internal_leakage": "the jack leaks past its piston",
}
