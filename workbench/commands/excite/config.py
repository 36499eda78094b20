"""The sets of excitations that a sheet needs."""

VALVE_TEST, FORCE_TEST = "valve-test", "force-test"
SETS = (VALVE_TEST, FORCE_TEST)  # the records of a sheet, a folder of them
