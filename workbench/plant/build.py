"""The only place where a plant is assembled from its parts."""

from collections.abc import Sequence
from functools import reduce

import casadi as ca

from ..base.errors import InputError
from ..base.signals import LINE_PRESSURES
from ..rigs.inner_loop import POSITION
from ..rigs.linear_rig import LinearRig
from ..rigs.rig import Rig
from . import jack as jacks, line_valve as line_valves
from .assembly import Assembly, Plant
from .effects import Effect, applies, known_effects, missing, resolve
from .inner_loop import valve_command
from .jack import cell_forces, loader_force, specimen_force
from .linear import build_linear
from .oil import above_vacuum, chamber, continuity, oil
from .orifice import root
from .valve import VALVES, Lands, ValveFlows
from .valve.lands import main_openings

_Pair = tuple[ca.SX, ca.SX]

_PORT = 35e5  # Pa: load ports of a valve on its test bench
_BLOCKED = 5e-5  # m^3: oil behind a blocked port
_BENCH_SUPPLY = 70e5  # Pa: its land supply, against a drain at 0: 35 bar a land


def build(rig: Rig, also: Sequence[Effect] = ()) -> Plant:
    """The plant of a whole rig: command, specimen and disturbance in; every signal of the rig out.

    Parameters
    ----------
    rig
        The rig; a linear plant takes no effects.
    also
        Effects beyond those that the rig declares, at their typical numbers.

    Returns
    -------
    The plant.

    Raises
    ------
    InputError
        For an effect that does not apply to this kind of rig.
    """
    if isinstance(rig, LinearRig):
        return build_linear(rig)
    b = _assembly(rig, rig.name, also)
    _check_slots(rig, b.effects)
    command = b.input("command", "1", 1.0)
    cylinder, lines = _oil(b, rig)
    x = b.state("x", "m", rig["S"] / 2)
    v = b.state("v", "m/s", rig.limit("speed"))
    supply = b.slot("supply", b["Ps"])
    travel, speed = b.slot("piston", (x, v))
    force = specimen_force(b, x, v)
    if rig.inner:
        controlled = travel + b["xmid"] if rig.inner.controls == POSITION else force
        command = valve_command(b, rig.inner, command, controlled, speed, cylinder.pa - cylinder.pb)
    ports, valve, flows = _through_lines(b, rig, command, cylinder, lines, supply)
    jacks.fill(b, cylinder, flows, travel, speed, b["Pr"])
    if "AL" in b:
        force += loader_force(b, valve, x, v)
    rod = jacks.rod_force(b, cylinder, travel, speed)
    acceleration = _acceleration(b, rod, force, x, v)
    b.rate("x", v)
    b.rate("v", acceleration)
    _outputs(b, valve, cylinder, lines, ports, supply)
    b.output(
        position=travel + b["xmid"],
        velocity=speed,
        acceleration=acceleration,
        **cell_forces(b, rod, force, acceleration),
    )
    b.measure()
    return b.finish()


def build_force_port(rig: Rig) -> Plant:
    """The jack as part of a multibody program: command, position and velocity in, rod force out; no own mass.

    Beside a program with steps of its own H, stagger them (engine/staggered.py does): the program steps its positions
    with its speeds held, the port follows with position and speed held over the same step, and its force then changes
    the speeds. That keeps the damping of a mode w of the masses on the oil and is stable while w H < 2. A force of the
    step before takes w H/2 of damping from it: about zero at 0.1 ms, the wrong sign at 1 ms.

    Parameters
    ----------
    rig
        The rig of the jack.

    Returns
    -------
    The plant.
    """
    b = _assembly(rig, f"{rig.name} force port")
    command = b.input("command", "1", 1.0)
    x = b.input("position", "m", rig["S"] / 2) - b["xmid"]
    v = b.input("velocity", "m/s", rig.limit("speed"))
    cylinder, lines = _oil(b, rig)
    supply = b.slot("supply", b["Ps"])
    ports, valve, flows = _through_lines(b, rig, command, cylinder, lines, supply)
    jacks.fill(b, cylinder, flows, x, v, b["Pr"])
    _outputs(b, valve, cylinder, lines, ports, supply)
    b.output(force=jacks.rod_force(b, cylinder, x, v))
    b.measure()
    return b.finish()


def build_pilot_bench(rig: Rig) -> Plant:
    """The pilot alone on a flow bench: current [A] in, its spool and flow out; ports at 35 bar, lands fed at 70 bar.

    Raises InputError for a kind of valve without a pilot.
    """
    b = _assembly(rig, f"{rig.name} pilot")
    lands = Lands(ca.SX(_PORT), ca.SX(_PORT), ca.SX(_BENCH_SUPPLY), ca.SX(0))
    pilot = VALVES[rig.valve].pilot(b, lands, b["Ps"], b["Pr"])
    b.output(**pilot.signals, flow=pilot.into_a, lowest_pressure=pilot.lowest)
    return b.finish()


def build_valve_bench(rig: Rig) -> Plant:
    """One valve on a flow bench: command in, main spool and flow out; ports at 35 bar, main lands fed at 70 bar."""
    b = _assembly(rig, f"{rig.name} valve")
    command = b.input("command", "1", 1.0)
    lands = Lands(ca.SX(_PORT), ca.SX(_PORT), ca.SX(_BENCH_SUPPLY), ca.SX(0))
    valve = VALVES[rig.valve].flows(b, command, lands, b["Ps"], b["Pr"])
    b.output(command=command, **valve.signals, flow=valve.into_a, lowest_pressure=valve.lowest)
    return b.finish()


def build_blocked_valve(rig: Rig) -> Plant:
    """One valve with blocked load ports at the rig's supply: command in; port pressures, and as `flow` what its main
    lands let through from the supply, out.

    Raises InputError for a kind of valve without lands.
    """
    b = _assembly(rig, f"{rig.name} valve, ports blocked")
    if "K3" not in b:
        raise InputError(f"{rig.name}: a {rig.valve} valve has no lands that ports could be blocked behind")
    command = b.input("command", "1", 1.0)
    rest = 0.5 * (rig["Ps"] + rig["Pr"])
    ports = [chamber(b, name, b.magnitude("Ps"), rest) for name in ("PA", "PB")]
    pa, pb = (port.pressure for port in ports)
    lands = Lands(pa, pb, b["Ps"], b["Pr"])
    valve = VALVES[rig.valve].flows(b, command, lands, b["Ps"], b["Pr"])
    for port, flow in zip(ports, (valve.into_a, -valve.out_of_b), strict=True):
        continuity(b, port, flow, ca.SX(_BLOCKED))
    ahead, back = main_openings(b, valve.signals["spool"])
    leak = b["K3"] * (ahead * root(lands.supply - pa) + back * root(lands.supply - pb))
    b.output(command=command, **valve.signals, pa=pa, pb=pb, flow=leak, lowest_pressure=valve.lowest)
    return b.finish()


def _assembly(rig: Rig, name: str, also: Sequence[Effect] = ()) -> Assembly:
    try:
        effects = resolve(rig)
    except InputError as error:
        raise InputError(f"rig {rig.name}: {error}") from None
    effects += tuple((effect, {number.name: number.typical for number in effect.numbers}) for effect in also)
    names = [effect.name for effect, _ in effects]
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise InputError(f"rig {rig.name}: {twice[0]} would be there twice; a plant has one formula of an effect")
    return Assembly(name, {key: number.value for key, number in rig.numbers.items()}, effects)


def _check_slots(rig: Rig, effects: Sequence[Effect]) -> None:
    """An effect that would do nothing is a mistake."""
    for effect in effects:
        if not applies(effect, rig):
            same = (e for e in known_effects(rig.effect_files) if e.name == effect.name)
            others = [e.formula for e in same if applies(e, rig)]
            hint = f'formula "{others[0]}" does' if others else "take it out"
            why = f"which has {missing(effect, rig.valve)}"
            raise InputError(f"rig {rig.name}: {effect.title} does not apply to a {rig.valve} valve, {why}; {hint}")


def _acceleration(b: Assembly, rod: ca.SX, specimen: ca.SX, x: ca.SX, v: ca.SX) -> ca.SX:
    """Acceleration [m/s^2] of the moving mass, between the rod and the load cell."""
    body = b.slot("body_force", ca.SX(0), position=x, velocity=v)
    return b.slot("acceleration", (rod - specimen - body) / b["M"], rod_force=rod, mass=b["M"])


def _draw(b: Assembly, rig: Rig, valve: ValveFlows, supply: ca.SX) -> None:
    """The flows [m^3/s] that the main lands, and another function, draw from the supply; the rated one is at full
    travel, 35 bar a land."""
    drawn, other = b["n"] * (ca.fmax(valve.into_a, 0) + ca.fmax(-valve.out_of_b, 0)), ca.SX(0)
    if "other_AA" in b:
        velocity = b.input("other_velocity", "m/s", rig.limit("speed"))
        other = b["other_AA"] * ca.fmax(velocity, 0) + b["other_AB"] * ca.fmax(-velocity, 0)
    b.slot("supply_flow", None, flow=drawn, other=other, rated=VALVES[rig.valve].rated_flow(b), supply=supply)


def _oil(b: Assembly, rig: Rig) -> tuple[jacks.Chambers, line_valves.Lines]:
    """The chambers, and the lines that valves in them part from these."""
    rest = VALVES[rig.valve].rest_pressure(rig)
    cylinder = jacks.chambers(b, rig.jack_kind, rest)
    return cylinder, line_valves.lines(b, rig.line_valve, cylinder, rest)


def _through_lines(
    b: Assembly, rig: Rig, command: ca.SX, cylinder: jacks.Chambers, lines: line_valves.Lines, supply: ca.SX
) -> tuple[_Pair, ValveFlows, _Pair]:
    """What the valve's ports see [Pa], the flows of one valve, and what comes of all to the chambers [m^3/s]."""
    far = line_valves.ends(lines, cylinder)
    rated, middle = VALVES[rig.valve].rated_flow(b), b["S"] / 2 * (cylinder.area_a + cylinder.area_b) / 2
    ports = b.slot("ports", (far[0].pressure, far[1].pressure), **oil(b))
    valve = VALVES[rig.valve].flows(b, command, Lands(ports[0], ports[1], supply, b["Pr"]), supply, b["Pr"])
    _draw(b, rig, valve, supply)
    flows = b.slot(
        "line_flows",
        (b["n"] * valve.into_a, b["n"] * valve.out_of_b),
        pa=far[0].pressure,
        pb=far[1].pressure,
        room_a=far[0].room,
        room_b=far[1].room,
        volume=middle + (cylinder.dead_a + cylinder.dead_b) / 2,
        rated=rated,
        feed=b["Ps"],
        **oil(b),
    )
    return ports, valve, line_valves.passed(b, rig.line_valve, lines, cylinder, flows)


def _outputs(
    b: Assembly,
    valve: ValveFlows,
    cylinder: jacks.Chambers,
    lines: line_valves.Lines,
    ports: _Pair,
    supply: ca.SX,
) -> None:
    """Signals of valve and chambers; a pressure is measured at the servo-valve, or behind a line valve."""
    chambers, read = (cylinder.pa, cylinder.pb), list(ports)
    lowest = [*chambers, *(line.pressure for line in lines if line), *ports]
    for side, line in enumerate(lines):
        if line:
            read[side] = chambers[side]
            b.output(**{LINE_PRESSURES[side]: ports[side]})
    pa, pb = (b.sensor(name, pressure) for name, pressure in zip(("pa", "pb"), read, strict=True))
    b.output(
        **valve.signals,
        pa=pa,
        pb=pb,
        load_pressure=pa - pb,
        supply=supply,
        jack_force=cylinder.force,
        lowest_pressure=ca.fmin(valve.lowest, reduce(ca.fmin, dict.fromkeys(lowest))) + above_vacuum(b),
    )
