"""The parts of a pump drive, each declaring its own states: they compose in plant/valve/pump.py and
two_way_pump.py.

shaft        the shaft that turns the pump: its speed as measured, or a motor with losses, or a speed loop over that
pump         displacement, leakage, and the relief valve
selector     on/off direction valves with a check valve in the delivery
low_side     a gas accumulator or tank behind its line
loader       a second cylinder that pushes back with a set pressure
"""
