"""A platform on six jacks as one plant: six force ports and a rigid body, with no constraint that could drift.

The pose is the state, and the legs' lengths and speeds follow from it. Its angles are roll, pitch and yaw, singular at
a pitch of +-90 degrees only. Inputs: `command1` to `command6`, and a wrench on the platform at its origin along the
base axes. Outputs are named `legN.signal` after the jack's signals, with the leg's position as its sensor says it, and
after the axes of the pose.
"""

from dataclasses import dataclass, replace

import casadi as ca

from ..base.errors import InputError
from ..rigs.platform import AXES, Leg, Platform
from ..rigs.platform.effects import FLEXIBLE, FRICTION, PLAY
from .assembly import Assembly, Plant
from .build import build_force_port
from .platform_body import LegMotion, Pose, angle_rates, leg_inertia, leg_motion, payload_inertia, rotation_of
from .platform_effects import FreeRod, flexible_payload, free_rod, joint_friction, move_rod

WRENCH = ("force_x", "force_y", "force_z", "moment_x", "moment_y", "moment_z")
TWIST = ("velocity_x", "velocity_y", "velocity_z", "turning_x", "turning_y", "turning_z")
ACCELERATION = tuple(f"{axis}_acceleration" for axis in AXES)
_SIZES = {"m": 0.25, "rad": 0.2, "m/s": 1.0, "rad/s": 1.0, "N": 1e4, "N m": 1e4}


@dataclass(frozen=True)
class _Jack:
    """A leg's force port: what it is called, the port, its place in the states, and its outputs by name."""

    name: str
    port: Plant
    states: ca.SX
    p: ca.SX
    command: ca.SX


def build_platform(platform: Platform) -> Plant:
    """The whole plant, all SI. Raises InputError for jacks whose commands have different delays."""
    ports = platform.of_rigs(build_force_port)
    b = Assembly(platform.name, _numbers(platform, ports))
    jacks = [_jack(b, f"leg{i + 1}", port) for i, port in enumerate(ports)]
    wrench = ca.vertcat(*(b.input(name, unit, _SIZES[unit]) for name, unit in zip(WRENCH, _units("N"), strict=True)))
    pose = _pose(b)
    loose = {effect.leg - 1 for effect in platform.effects if effect.name == PLAY}
    legs = [leg_motion(b, jack.name, pose, i in loose) for i, jack in enumerate(jacks)]
    rods = [free_rod(b, jack.name, legs[i]) if i in loose else None for i, jack in enumerate(jacks)]
    matrix, total = payload_inertia(b, pose)
    total += wrench
    for effect in platform.effects:
        if effect.name == FRICTION:
            total += joint_friction(b, f"leg{effect.leg}", legs[effect.leg - 1], pose)
        elif effect.name == FLEXIBLE:
            taken, beside = flexible_payload(b, pose)
            matrix, total = matrix + taken, total + beside
    forces, rates = [], []
    for jack, leg, rod in zip(jacks, legs, rods, strict=True):
        own, beside = leg_inertia(leg)
        signals = _run_jack(b, jack, leg, rod)
        forces.append(signals["force"] if rod is None else rod.push)
        rates.append(None if rod is None else move_rod(b, jack.name, leg, rod, signals["force"]))
        pull = forces[-1] * leg.along
        matrix, total = matrix + own, total + beside + ca.vertcat(pull, ca.cross(leg.arm, pull))
    acceleration = ca.ldl_solve(total, *ca.ldl(matrix))
    _move(b, pose, acceleration)
    for jack, leg, force, rate in zip(jacks, legs, forces, rates, strict=True):
        _measure(b, jack, leg, force, acceleration, rate)
    lowest = [b.outputs[f"{jack.name}.lowest_pressure"] for jack in jacks]
    b.output(lowest_pressure=ca.mmin(ca.vertcat(*lowest)))
    b.dry_friction(*(f"{effect.label}.moment" for effect in platform.effects if effect.name == FRICTION))
    return _late(b.finish(), ports)


def _late(plant: Plant, ports: list[Plant]) -> Plant:
    """With the delay of the commands, which all jacks share."""
    if len({(port.lateness(), port.interpolated) for port in ports}) > 1:
        raise InputError(f"platform {plant.name}: the commands of its jacks have different delays; give them one")
    delay = ports[0].delay and f"leg1.{ports[0].delay}"
    return replace(plant, delay=delay, interpolated=ports[0].interpolated)


def _numbers(platform: Platform, ports: list[Plant]) -> dict[str, float]:
    numbers = {name: number.value for name, number in platform.numbers.items()}
    for i, (leg, port) in enumerate(zip(platform.legs, ports, strict=True)):
        own = _leg_numbers(leg) | dict(zip(port.parameters, port.p.tolist(), strict=True))
        numbers |= {f"leg{i + 1}.{name}": value for name, value in own.items()}
    return numbers | _effect_numbers(platform)


def _leg_numbers(leg: Leg) -> dict[str, float]:
    ends = {"base": leg.base, "joint": leg.joint}
    points = {f"{end}_{axis}": value for end, point in ends.items() for axis, value in zip("xyz", point, strict=True)}
    return points | {name: number.value for name, number in leg.numbers.items()}


def _effect_numbers(platform: Platform) -> dict[str, float]:
    return {
        f"{effect.label}.{name}": number.value for effect in platform.effects for name, number in effect.numbers.items()
    }


def _units(linear: str) -> list[str]:
    """The units of six components: of forces, lengths or speeds."""
    return [linear] * 3 + [{"N": "N m", "m": "rad", "m/s": "rad/s"}[linear]] * 3


def _jack(b: Assembly, name: str, port: Plant) -> _Jack:
    command = b.input(f"command{name[3:]}", "1", 1.0)
    states = [b.state(f"{name}.{state.name}", state.unit, state.scale, state.start) for state in port.states]
    p = ca.vertcat(*(b[f"{name}.{number}"] for number in port.parameters))
    b.dry_friction(*(f"{name}.{number}" for number in port.dry_friction))
    return _Jack(name, port, ca.vertcat(*states), p, command)


def _pose(b: Assembly) -> Pose:
    place = [b.state(axis, unit, _SIZES[unit]) for axis, unit in zip(AXES, _units("m"), strict=True)]
    twist = [b.state(name, unit, _SIZES[unit]) for name, unit in zip(TWIST, _units("m/s"), strict=True)]
    origin = ca.vertcat(place[0], place[1], place[2] + b["height"])
    pose = Pose(origin, ca.vertcat(*twist[:3]), rotation_of(*place[3:]), ca.vertcat(*twist[3:]))
    rates = ca.vertcat(pose.velocity, angle_rates(place[4], place[5], pose.turning))
    for i, axis in enumerate(AXES):
        b.rate(axis, rates[i])
    b.output(**dict(zip(AXES, place, strict=True)))
    return pose


def _run_jack(b: Assembly, jack: _Jack, leg: LegMotion, rod: FreeRod | None) -> dict[str, ca.SX]:
    """The rates of a jack's states; its outputs by name. It moves as its leg does, or as a rod that is free of it."""
    port, speed = jack.port, leg.speed
    travel = leg.length - b[f"{jack.name}.length"] + b[f"{jack.name}.xmid"]
    if rod is not None:
        travel, speed = travel + rod.gap, rod.speed
    inputs = {"command": jack.command, "position": travel, "velocity": speed}
    u = ca.vertcat(*(inputs.get(variable.name, 0) for variable in port.inputs))
    rates, outputs = port.f(jack.states, u, jack.p), port.h(jack.states, u, jack.p)
    for i, state in enumerate(port.states):
        b.rate(f"{jack.name}.{state.name}", rates[i])
    signals = {name: outputs[i] for i, name in enumerate(port.outputs)}
    b.output(**{f"{jack.name}.{name}": value for name, value in signals.items() if name != "force"})
    b.output(**{f"{jack.name}.position": travel, f"{jack.name}.velocity": speed})
    return signals


def _move(b: Assembly, pose: Pose, acceleration: ca.SX) -> None:
    for i, name in enumerate(TWIST):
        b.rate(name, acceleration[i])
    b.output(**{name: acceleration[i] for i, name in enumerate(ACCELERATION)})
    twist = ca.vertsplit(ca.vertcat(pose.velocity, pose.turning))
    b.output(**dict(zip(TWIST, twist, strict=True)))


def _measure(b: Assembly, jack: _Jack, leg: LegMotion, force: ca.SX, acceleration: ca.SX, own: ca.SX | None) -> None:
    """Acceleration of the rod along its leg, its `own` where the joint lets it move, and the force between rod and
    platform."""
    joint = acceleration[:3] + ca.cross(acceleration[3:], leg.arm) + leg.turned
    borne = ca.dot(leg.along, leg.mass @ joint + leg.bias - leg.weight)
    rate = ca.dot(leg.along, joint) + leg.bent
    if own is not None:
        borne, rate = 0, own
    b.output(**{f"{jack.name}.acceleration": rate, f"{jack.name}.force": force - borne})
