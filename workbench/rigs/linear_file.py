"""Files of linear plants.

A file has one of the tables [state_space], [transfer_function], [chain] and [frequency_response], the last with a
sheet that a transfer function and a delay are fitted to, each with a factor `gain` on all of it, then [signals] (what
full command is in the model's input, the units of its outputs, the delay of the command, what a force amounts to),
[limits] (the stroke at least), [control], [sensors.NAME], and [bounds] of numbers that are uncertain.

The unit of the position says what is controlled: a length, an angle, a force, a voltage, a temperature, ... Limits,
sensors, scenarios and reports are then in units of that. In a controller's design numbers "m" stands for its SI unit:
a gain of 2 1/m is 2 1/rad.
"""

from collections.abc import Mapping
from warnings import catch_warnings, simplefilter

import numpy as np

from ..base.errors import nearest
from ..base.signals import Signal
from ..base.table import ConfigTable
from ..base.units import Spec, quantity, to_si
from ..records.rational_fit import RationalFit
from . import schema
from .linear_form import ChainForm, LinearForm, StateSpaceForm, TransferFunctionForm
from .linear_rig import DELAY, GAIN, LOAD, LinearRig
from .linear_sheet import fit_sheet
from .linear_signals import limit_specs, measured_as, output_signals
from .number import Number
from .rig import COMPUTING_DELAY
from .sensor import Sensor, read_sensors
from .together import check_speed_guard

FREQUENCY_RESPONSE = "frequency_response"
FORMS = ("state_space", "transfer_function", "chain", FREQUENCY_RESPONSE)
_TABLES = (*FORMS, "signals", "limits", "control", "sensors", "bounds")
_NONE = "none"  # of its kinds of valve, spool loop and jack
_TITLES = ("name", "title", "source")
_MEASURED = ("position", "velocity", "acceleration")


def read_linear_rig(top: ConfigTable, stem: str) -> LinearRig:
    """A plant of a file's document. Raises InputError with file and row."""
    top.allow(*_TITLES, *_TABLES)
    given = [name for name in FORMS if name in top]
    if len(given) != 1:
        raise top.error(f"has {' and '.join(given)}; a plant is written in one way")
    signals = top.optional_table("signals", "command", "delay", "load", *_MEASURED)
    late = signals.quantity("delay", DELAY) if "delay" in signals else None
    fit = _fit(top.table(given[0]), signals, late) if given[0] == FREQUENCY_RESPONSE else None
    form, values = _fitted(fit) if fit else _READ[given[0]](top.table(given[0]))
    own = _signals(signals)
    units = tuple(_unit(signals, own[name]) for name in form.outputs)
    delay = fit.delay if fit else late or 0.0
    numbers = {"gain": top.table(given[0]).number("gain", 1.0), **values, "delay": delay}
    specs = {**form.specs(), "gain": GAIN, "load": LOAD, "delay": DELAY}
    full = signals.positive("command", "the model's unit") if "command" in signals else 1.0
    if "load" in signals:
        numbers["load"] = signals.quantity("load", LOAD)
    bounds = _bounds(top.optional_table("bounds"), numbers, specs)
    control = top.table("control", *schema.CONTROL)
    period = _plain(control, "period", schema.CONTROL["period"])
    limits = _limits(top.table("limits"), limit_specs(own["position"].si))
    measured = {name: own[name] for name in form.outputs}
    ideal = {name: Sensor(0.0, 0.0) for name in form.outputs}
    sensors = read_sensors(top.table("sensors", *form.outputs), measured) if "sensors" in top else ideal
    check_speed_guard(top, sensors, limits["speed"].value * period.value)
    return LinearRig(
        name=top.named(top.text("name", stem)),
        title=top.text("title", ""),
        source=top.text("source", str(fit) if fit else ""),
        valve=_NONE,
        corrector=_NONE,
        jack=_NONE,
        numbers={name: _number(name, specs[name], value, *bounds.get(name, ())) for name, value in numbers.items()},
        limits=limits,
        period=period,
        sensors=sensors,
        computing_delay=_computing_delay(control),
        deadline=_plain(control, "deadline", schema.CONTROL["deadline"]) if "deadline" in control else None,
        form=form,
        full_command=full,
        units=units,
        fit=fit,
    )


def _signals(table: ConfigTable) -> Mapping[str, Signal]:
    """What the outputs are, by the unit of the position."""
    unit = table.text("position", "m")
    return output_signals({"position": unit}, table.about("position", lambda: measured_as(unit)))


def _unit(table: ConfigTable, signal: Signal) -> str:
    """The unit of an output: SI where the file names none."""
    unit = table.text(signal.name, signal.si)
    table.about(signal.name, lambda: to_si(1.0, unit, signal.si))
    return unit


def _number(name: str, spec: Spec, value: float, low: float | None = None, high: float | None = None) -> Number:
    return Number(name, value, spec.unit, spec.unit, "", low, high)


def _plain(table: ConfigTable, name: str, spec: Spec) -> Number:
    return _number(name, spec, table.quantity(name, spec, "source"))


def _computing_delay(control: ConfigTable) -> Number:
    name = COMPUTING_DELAY.name
    return _plain(control, name, schema.CONTROL[name]) if name in control else COMPUTING_DELAY


def _limits(table: ConfigTable, specs: Mapping[str, Spec]) -> dict[str, Number]:
    """The stroke, and further limits where they are given: else no limit of theirs is ever met."""
    table.allow(*specs)
    limits = {}
    for name, spec in specs.items():
        if name in table or name == "stroke":
            limits[name] = _plain(table, name, spec)
        elif name not in schema.OPTIONAL:
            limits[name] = Number(name, spec.high, spec.unit, spec.unit, "no limit given")
    return limits


def _bounds(
    table: ConfigTable, numbers: Mapping[str, float], specs: Mapping[str, Spec]
) -> dict[str, tuple[float, ...]]:
    """[low, high] by name: SI numbers, or texts with a unit."""
    bounds = {}
    for name in table.allow(*numbers):
        written = table.values[name]
        if isinstance(written, list) and any(isinstance(end, str) for end in written):
            words = table.words(name, "1 ms")
            ends = table.about(name, lambda words=words, si=specs[name].unit: tuple(quantity(w, si) for w in words))
        else:
            ends = table.numbers(name, "[low, high]")
        if len(ends) != 2 or not ends[0] <= numbers[name] <= ends[1]:
            raise table.complaint(name, f"must be [low, high] about its value of {numbers[name]:g}")
        bounds[name] = ends
    return bounds


def _matrix(table: ConfigTable, name: str, columns: int | None = None) -> list[list[float]]:
    """Rows of finite numbers, all of one length."""
    rows = table.values.get(name)
    hint = f"write {name} = [[...], [...]], a list of rows of numbers"
    if not isinstance(rows, list) or not rows or not all(isinstance(row, list) for row in rows):
        raise table.complaint(name, hint)
    if any(len(row) != (columns or len(rows[0])) for row in rows):
        raise table.complaint(name, f"has rows of other lengths than {columns or len(rows[0])}; {hint}")
    place = table.replaced({f"{name} row {i + 1}": row for i, row in enumerate(rows)})
    return [list(place.numbers(f"{name} row {i + 1}", "[1.0, 0.0]")) for i in range(len(rows))]


def _state_space(table: ConfigTable) -> tuple[LinearForm, dict[str, float]]:
    table.allow("gain", "A", "B", "C", "D", "E", "outputs", "period")
    a = _matrix(table, "A")
    n = len(a)
    if len(a[0]) != n:
        raise table.complaint("A", f"is {n} x {len(a[0])}; it must be square")
    outputs = table.words("outputs", "position", ("position",))
    if unknown := [name for name in outputs if name not in _MEASURED]:
        raise table.complaint("outputs", nearest(unknown[0][:80], _MEASURED))
    parts = {"A": a, "B": _matrix(table, "B", 1), "C": _matrix(table, "C", n)}
    parts |= {"E": _matrix(table, "E", 1)} if "E" in table else {}
    _check_shapes(table, parts, outputs)
    if "period" in table:
        parts = _continuous(table, parts, table.quantity("period", schema.CONTROL["period"]))
        a = parts["A"]
    values = {f"A_{i + 1}_{j + 1}": entry for i, row in enumerate(a) for j, entry in enumerate(row)}
    values |= {f"B_{i + 1}": row[0] for i, row in enumerate(parts["B"])}
    values |= {f"C_{i + 1}_{j + 1}": entry for i, row in enumerate(parts["C"]) for j, entry in enumerate(row)}
    values |= {f"E_{i + 1}": row[0] for i, row in enumerate(parts.get("E", []))}
    return StateSpaceForm(n, outputs, "E" in table), values


def _check_shapes(table: ConfigTable, parts: Mapping[str, list[list[float]]], outputs: tuple[str, ...]) -> None:
    """Raises InputError for matrices that do not belong together, and for a D that is not 0."""
    n = len(parts["A"])
    wanted = {"B": n, "C": len(outputs), "E": n}
    for name, rows in parts.items():
        if name in wanted and len(rows) != wanted[name]:
            raise table.complaint(name, f"has {len(rows)} rows; A and outputs ask for {wanted[name]}")
    if "D" in table and any(any(row) for row in _matrix(table, "D", 1)):
        raise table.complaint("D", "must be 0: what is measured cannot answer at once; add a fast lag to the model")


def _continuous(table: ConfigTable, parts: dict[str, list[list[float]]], period: float) -> dict[str, list[list[float]]]:
    """A model with held inputs, sampled every `period` [s], as differential equations."""
    from scipy.linalg import logm

    n, inputs = len(parts["A"]), np.hstack([np.array(parts[name]) for name in ("B", "E") if name in parts])
    whole = np.eye(n + inputs.shape[1])
    whole[:n] = np.hstack((np.array(parts["A"]), inputs))
    if not np.linalg.matrix_rank(whole[:n, :n]) == n:
        raise table.complaint("A", "has a pole at z = 0, which is a delay; write it as the delay of [signals]")
    with catch_warnings():
        simplefilter("ignore", RuntimeWarning)  # of an error of 1e-12
        rates = np.asarray(logm(whole)) / period
    if np.abs(np.imag(rates)).max() > 1e-6 * np.abs(rates).max():
        raise table.complaint("A", "has a negative real pole z, which no differential equation has; fit another order")
    columns = np.real(rates[:n, n:]).T.tolist()
    entering = dict(zip([name for name in ("B", "E") if name in parts], columns, strict=True))
    return {
        **parts,
        "A": np.real(rates[:n, :n]).tolist(),
        **{name: [[v] for v in col] for name, col in entering.items()},
    }


def _transfer_function(table: ConfigTable) -> tuple[LinearForm, dict[str, float]]:
    table.allow("gain", "numerator", "denominator")
    num, den = (table.numbers(name, "[1.0, 2.0]") for name in ("numerator", "denominator"))
    for name, part in (("numerator", num), ("denominator", den)):
        if not part[0]:
            raise table.complaint(name, "begins with 0; begin with the highest power of s that there is")
    if not len(num) < len(den):
        raise table.complaint("numerator", "must be of lower order than the denominator; add a fast lag to the model")
    return _polynomials(num, den)


def _polynomials(num: tuple[float, ...], den: tuple[float, ...]) -> tuple[LinearForm, dict[str, float]]:
    values = {f"num_{i}": value for i, value in enumerate(num)} | {f"den_{i}": value for i, value in enumerate(den)}
    return TransferFunctionForm(len(num) - 1, len(den) - 1, _pace(den)), values


def _fit(table: ConfigTable, signals: ConfigTable, delay: float | None) -> RationalFit:
    """The model of a sheet. Raises InputError for one that is too far from it, or too late."""
    signal = _signals(signals)["position"]
    fit = fit_sheet(table, _unit(signals, signal), signal.si, delay)
    if problem := DELAY.problem(fit.delay):
        raise table.error(f"the delay fitted: {problem}; give the delay of [signals]")
    return fit


def _fitted(fit: RationalFit) -> tuple[LinearForm, dict[str, float]]:
    """Its transfer function, of SI units."""
    return _polynomials(tuple(fit.numerator.tolist()), tuple(fit.denominator.tolist()))


def _pace(den: tuple[float, ...]) -> float:
    """The geometric mean [rad/s] of the poles that are not 0; 1 where all are."""
    poles = np.abs(np.roots(den))
    poles = poles[poles > 1e-9 * poles.max(initial=0.0)]
    return float(np.exp(np.mean(np.log(poles)))) if len(poles) else 1.0


def _chain(table: ConfigTable) -> tuple[LinearForm, dict[str, float]]:
    table.allow("gain", "integrators", "lags", "modes")
    modes = table.tables("modes", "frequency", "damping")
    lags = table.words("lags", "5 ms") if "lags" in table else ()
    form = ChainForm(len(lags), len(modes), table.count("integrators", 0) if "integrators" in table else 0)
    if not form.order:
        raise table.error("has no part; give integrators, lags or modes")
    specs: Mapping[str, Spec] = form.specs()
    values: dict[str, float] = {}
    for i, lag in enumerate(lags):
        values[f"lag_{i + 1}"] = table.about("lags", lambda lag=lag: quantity(lag, "s"))
    for i, mode in enumerate(modes):
        for key in ("frequency", "damping"):
            values[f"mode_{i + 1}_{key}"] = mode.quantity(key, specs[f"mode_{i + 1}_{key}"])
    for name, value in values.items():
        if problem := specs[name].problem(value):
            raise table.error(f"{name}: {problem}")
    return form, values


_READ = {"state_space": _state_space, "transfer_function": _transfer_function, "chain": _chain}
