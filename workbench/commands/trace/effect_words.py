"""Every effect in plain words, by its name: nothing of it is built for that."""

EFFECT = {
    "drive.delay": "the command acts late",
    "drive.lag": "the drive is slower than the rig file says",
    "drive.saturation": "the drive has less current than the rig file says",
    "drive.corrector": "the spool loop has a corrector that the rig file lacks",
    "pilot.hysteresis": "the torque motor has hysteresis",
    "main.stiction": "the main spool sticks",
    "main.rate": "the spool moves no faster",
    "main.deadband": "the main spool has a dead band",
    "main.asymmetry": "the valve's gain differs between the directions",
    "supply.sag": "the supply pressure sags under flow",
    "supply.limit": "the pump gives no more flow",
    "oil.air": "there is air in the oil",
    "jack.external_leakage": "a chamber leaks to the outside",
    "jack.friction": "the jack rubs",
    "load.bias": "a constant force pushes the jack",
    "load.spring": "a spring holds the load",
    "load.compliance": "the mount or the rod gives",
    "sensor.lag": "the pressure sensors are late",
    "sensor.filter": "a low pass of the logger delays all that is measured",
}
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
ALL_EFFECTS = EFFECT | PUMP_EFFECT
