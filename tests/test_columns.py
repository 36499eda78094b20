"""What a column's name, unit and range say, beside a rig: a signal, or why it is none."""

import numpy as np
import pytest

from workbench.identify.columns.conversion import Conversion, conversion
from workbench.identify.columns.guess import guess_columns
from workbench.identify.columns.roles import motion, roles
from workbench.identify.columns.summary import summary
from workbench.records import Record
from workbench.records.foreign.unit_names import heading_of, name_of
from workbench.records.foreign.vocabulary import strengths

NAMES = {
    "t": "Zeit, time, Temps, t, Zeitstempel, tout",
    "command": "Ventil Soll, u_valve, Commande vanne, Stellgröße, spool_cmd, command, Ansteuerung, Ventil_V, valve, "
    "Ventil_Soll_V, Valve set value, valve_setpoint_V, Valve volts, consigne de la vanne, tension vanne, "
    "consigna_valvula_V, mando servoválvula, Valve position setpoint",
    "reference": "consigna posición, Weg Soll, x_soll, Position consigne, reference",
    "spool": "Schieberweg, xv, spool position, Valve Position, Tiroir, Spool LVDT, x_V, Posición válvula",
    "pa": "presion_camara_A_bar, Druck Kammer A, "
    "p_A, pA, Druck A, Pression A, pressure_a, Kammerdruck A, Druck Kolbenseite, p_cap, data.p_A",
    "pb": "p_B, Druck_B, Pression B, p_rod, Druck Stangenseite",
    "load_pressure": "Lastdruck, load pressure, delta_p, Differenzdruck",
    "supply": "Presión de alimentación, Ps, p_0, Versorgungsdruck, pump pressure, Pression alimentation",
    "position": "Desplazamiento del pistón, carrera, "
    "Weg, x, Position, Kolbenweg, Déplacement, X_pos, Cylinder position, Weg ist",
    "velocity": "x1_dot, xdot, Geschwindigkeit, Vitesse, v",
    "acceleration": "Beschl., x1_ddot, Accel, Accélération, Beschleunigung",
    "force": "fuerza_kN, celda de carga, Kraft_N, Kraft, F_ist, Effort, Load cell, F, ai0 Kraft",
    "current": "corriente válvula, Ventilstrom, current, Courant, i_valve",
}


@pytest.mark.parametrize(("signal", "name"), [(s, n) for s, names in NAMES.items() for n in names.split(", ")])
def test_names_of_four_languages(signal, name):
    assert list(strengths(name_of(name))) == [signal]


@pytest.mark.parametrize("cell", ["Ventil_Soll_V", "consigna_valvula_V", "Valve volts", "valve command (volt)"])
def test_volts_of_a_valve_are_a_command(rig, cell):
    guess = guess_columns([of(cell, heading_of(cell).unit, -4, 5)], rig)[0]
    assert (guess.signal, guess.mapping.scale) == ("command", 0.1)


@pytest.mark.parametrize(
    "name", ["Tankdruck", "p_T", "Öltemperatur", "Kraft Soll", "consigna fuerza", "Index", "Signal 1", "direction", ""]
)
def test_names_that_mean_no_signal(name):
    assert not strengths(name)


def of(cell, unit, *values):
    return summary(cell, unit, [("a", np.array(values, dtype=float))])


@pytest.mark.parametrize(
    ("signal", "unit", "values", "expected"),
    [
        ("command", "V", (-4, 5), (0.1, "1", 0.0)),
        ("command", "%", (-40, 50), (1.0, "%", 0.0)),
        ("command", None, (-0.4, 0.5), (1.0, "1", 0.0)),
        ("command", None, (-9.9, 10), (0.1, "1", 0.0)),
        ("position", "mm", (-200, 180), (1.0, "mm", 0.0)),
        ("position", "mm", (20, 480), (1.0, "mm", -250.0)),
        ("position", None, (-0.2, 0.18), (1.0, "m", 0.0)),
        ("pa", "barg", (2, 180), (1.0, "bar", 1.01325)),
        ("pa", None, (2, 180), (1.0, "bar", 0.0)),
        ("pa", None, (2e5, 1.8e7), (1.0, "Pa", 0.0)),
        ("spool", "%", (-40, 50), (0.0229, "mm", 0.0)),
        ("acceleration", "standard_gravity", (-2, 3), (1.0, "standard_gravity", 0.0)),
    ],
)
def test_units_and_ranges(rig, signal, unit, values, expected):
    how = conversion(of("x", unit, *values), signal, rig)
    assert isinstance(how, Conversion)
    assert (how.scale, how.to, how.offset) == pytest.approx(expected)
    assert not how.problem


@pytest.mark.parametrize(
    ("signal", "unit", "values", "reason"),
    [
        ("command", None, (-4, 5), "what is full command"),
        ("command", "mA", (-4, 5), "does not say what full command is"),
        ("position", "V", (0, 10), "no unit of position"),
        ("position", None, (0, 9), "volts of a sensor"),
        ("position", "m", (-200, 180), "the stroke is 500 mm"),
        ("pa", None, (0.5, 19), "may be bar or MPa"),
        ("pa", "Pa", (2, 180), "the supply has 210 bar"),
        ("acceleration", None, (-2, 3), "no unit"),
        ("t", "s", (0, 1, 1, 0), "does not increase"),
        ("force", "kN", (np.nan, np.nan), "no number"),
    ],
)
def test_what_nothing_tells_is_no_guess(rig, signal, unit, values, reason):
    how = conversion(of("x", unit, *values), signal, rig)
    assert isinstance(how, str)
    assert reason in how


def test_the_better_name_and_the_unfiltered_column_are_taken(rig):
    columns = [of("x [mm]", "mm", 0, 9), of("Weg [mm]", "mm", 0, 9), of("p_A [bar]", "bar", 9, 90),
               of("p_A filtered [bar]", "bar", 9, 90), of("Kanal 7", "kN", 0, 9)]  # fmt: skip
    guesses = {guess.column.cell: guess for guess in guess_columns(columns, rig)}
    assert {cell: guess.signal for cell, guess in guesses.items()} == {
        "x [mm]": None, "Weg [mm]": "position", "p_A [bar]": "pa", "p_A filtered [bar]": None, "Kanal 7": "force",
    }  # fmt: skip
    assert guesses["Kanal 7"].confidence == "likely"
    assert all(guess.reason for guess in guesses.values())


def record(name, command, noise=0.01):
    t = np.arange(command.size) * 1e-3
    random = np.random.default_rng(len(name))
    return Record(
        name, t, {"command": command, "position": np.cumsum(command) * 1e-3 + noise * random.normal(size=t.size)}
    )


def test_repeats_stay_together_and_a_middle_command_is_held_out():
    wave = np.concatenate((np.zeros(300), np.sin(np.arange(1700) / 100)))
    records = [record(f"{size}-{i}", size / 10 * wave) for size in (1, 3, 5) for i in (1, 2)]
    proposed = roles([motion(each, each.name) for each in records])
    assert proposed.entries["heldout"] == ["3-1", "3-2"]
    assert proposed.entries["train"] == ["1-1", "1-2", "5-1", "5-2"]
    (rest,) = proposed.entries["static"]
    assert 0.2 < rest["to"] < 0.4


def test_a_file_alone_is_split_by_time():
    proposed = roles([motion(record("a", np.sin(np.arange(3000) / 100)), "a.parquet")])
    assert proposed.entries["train"] == [{"file": "a.parquet", "to": proposed.entries["heldout"][0]["from"]}]


def test_a_record_at_rest_measures_the_noise():
    records = [record("still", np.zeros(2000)), record("moves", np.sin(np.arange(3000) / 100))]
    assert roles([motion(each, each.name) for each in records]).entries["static"] == ["still"]
