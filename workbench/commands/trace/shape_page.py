"""What an unknown disturbance looks like, in the report of a trace."""

from ...identify.found.missing_shape import UnexplainedDisturbance
from ...report import Curve, Figure, Panel, Table


def shape_figure(of: UnexplainedDisturbance) -> Figure:
    """The disturbance against the signal that explains most of it."""
    assert of.points is not None
    assert of.curve is not None
    curves = [
        Curve("estimate", of.points[:, 0], of.points[:, 1], "markers", color="#8c959f"),
        Curve("mean", of.curve[:, 0], of.curve[:, 1], color="#d55e00"),
    ]
    line = f" It repeats at {of.line:.4g} Hz." if of.line else ""
    return Figure(
        f"The missing {of.name} over {of.signal.split(' [')[0]}",
        of.signal,
        [Panel(f"{of.name} [{of.unit}]", curves)],
        note="What has to be added to the model in the windows with the largest errors, by a Kalman smoother on the "
        f"linear model about the fit.{line}",
    )


def shape_tables(of: UnexplainedDisturbance) -> list[Table]:
    """How much of the disturbance each signal explains; or what is off at the sensors."""
    if of.sensors is not None:
        columns = ["sensor", "offset [bar]", "gain [%]", "lag [ms]"]
        note = "Means over the windows with the largest errors. A lag is positive where the sensor is late."
        return [Table("What the pressure sensors would have to be off by", columns, of.sensors, note=note)]
    rows = [[name, float(value)] for name, value in of.explained or []]
    note = "Cross-validated R2 of a curve through one signal: 1 explains all of it, 0 or less nothing."
    return [Table(f"What the missing {of.name} goes with", ["signal", "R2"], rows, note=note)]
