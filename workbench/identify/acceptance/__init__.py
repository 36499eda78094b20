"""Sheets that a laboratory signs: figures with 95 % intervals from recordings, or from a rig that is played.

row, regression       a line with its interval and limits; least squares under noise that lasts
opening, flow_curve   how far a valve was open; its flow over command, by a flow meter or by the piston's speed
curve_figures, hysteresis, null_shift, pressure, dynamics    what a valve's sheet reads off records
valve_test            the valve's sheet
sines                 where a record plays one, and other signals as amplitudes of it
force_static, force_dynamic, force_test    a load cell at rest and in motion beside a reference; its sheet
excitations           what a laboratory plays for a valve's sheet, and which of it is missing
bench, exact          a rig's valve on its test bench, played by the engine; the same lines without noise
when_new              the rig that plays a valve's sheet, with intervals
"""
