"""Refinements by which what an effect puts in passes through a linear element.

Where an effect passes on a signal (command, current, a transducer's pressure, openings) the whole signal passes
through the element; where it adds to others (a force, a flow), what it adds. With a static curve before it this is a
Hammerstein model, with one behind it a Wiener model (Giri, Bai, Block-oriented Nonlinear System Identification,
Springer 2010).
"""

from collections.abc import Callable, Sequence
from functools import partial

import casadi as ca

from ...base.errors import InputError
from .decorator import number, state
from .effect import Effect, EffectNumber, Scope
from .lag import first_order, second_order
from .natural import PASSAGES
from .reshape import Change, changed_output, passing_parts, put_on

MOST_POLES = 3
_LENGTHS = (1e-3, 1e-2, 1e-1)  # s: where the poles of a linear element start
_SLOWEST = 0.2  # s: in windows of half a second the free initial state of a slower pole sets it at will
_BAND = (4.0, 8.0, 15.0, 30.0, 120.0, 250.0)  # Hz

_Filter = Callable[[str, ca.SX, Scope], ca.SX]
"""Takes the name of its first state, what enters and the scope; returns what leaves."""

_tau = partial(number, si="s", shown="ms", low=0.0, off=0.0, refines=True)
_gain = partial(number, typical=0.2, si="1", shown="%", high=10.0, off=0.0, refines=True)
_zeta = partial(number, typical=0.3, si="1", low=0.02, high=2.0, meaning="its damping ratio", refines=True)


def pole(effect: Effect) -> Effect:
    """(1 + T0 d/dt) d = (1 + (tau + T0) d/dt) y, T0 = 10 us: y lags by tau, and is d at tau = 0 (off).

    One state for each part that passes. Raises InputError for a slot that takes no state.
    """
    tau = _tau("pole_tau", 2e-3, high=_SLOWEST, meaning="time constant of a further pole", tried=(5e-4, 2e-2))
    return _filtered(effect, "pole", "pole", lambda name, d, s: first_order(d, s, name, "pole_"), (tau,), [""])


def resonance(effect: Effect) -> Effect:
    """T^2 y'' + 2 zeta T y' + y = d, T = tau + 10 us; y is d at tau = 0 (off).

    A pair where zeta < 1, two real poles above. Two states for each part. Raises InputError as `pole`.
    """
    meaning = "period of a further resonance over 2 pi"
    tau = _tau("resonance_tau", 2e-3, high=0.1, meaning=meaning, tried=(5e-4, 1e-3, 4e-3, 1e-2))

    def passed(name: str, d: ca.SX, s: Scope) -> ca.SX:
        return second_order(d, s, name, "resonance_")

    return _filtered(effect, "resonance", "resonance", passed, (tau, _zeta("resonance_zeta")), ["", "_rate"])


def linear_element(effect: Effect, count: int) -> Effect:
    """y = d + sum of g_j x_j, T_j x_j' = d - x_j: one to three real poles, with the zeros that the gains make.

    Off (every g_j = 0) is the plain formula. A state for each pole and part. Raises InputError as `pole`, and for a
    number of poles that is not 1 to 3.
    """
    if not 1 <= count <= MOST_POLES:
        raise InputError(f'{effect.title}: "linear {count}": give it 1 to {MOST_POLES} poles')
    order = range(1, count + 1)

    def passed(name: str, d: ca.SX, s: Scope) -> ca.SX:
        y = d
        for j in order:
            slow = s.x(f"{name}_{j}")
            s.rate(f"{name}_{j}", (d - slow) / s.p(f"linear_T{j}"))
            y = y + s.p(f"linear_gain{j}") * slow
        return y

    numbers = [each for j in order for each in _real_pole(j)]
    return _filtered(effect, f"linear {count}", "linear", passed, numbers, [f"_{j}" for j in order])


def _real_pole(j: int) -> tuple[EffectNumber, EffectNumber]:
    """Gain and time constant of one pole."""
    length = _LENGTHS[j - 1]
    others = tuple(other for other in _LENGTHS if other != length)
    return (
        _gain(f"linear_gain{j}", low=-2.0, meaning=f"gain at rest that pole {j} adds"),
        number(
            f"linear_T{j}",
            length,
            "s",
            shown="ms",
            low=2e-4,
            high=_SLOWEST,
            meaning=f"time constant of pole {j}",
            tried=others,
            refines=True,
        ),
    )


def linear_pair(effect: Effect) -> Effect:
    """y = d + g1 w + g2 w'/w0, w''/w0^2 + 2 zeta w'/w0 + w = d, w0 = 2 pi f: a complex pair, with its zeros.

    Off (g1 = g2 = 0) is the plain formula. Two states for each part. Raises InputError as `pole`.
    """
    numbers = (
        _gain("pair_gain1", low=-2.0, meaning="gain at rest that the pair adds"),
        _gain("pair_gain2", low=-10.0, meaning="gain on its rate"),
        number("pair_f", 60.0, "Hz", low=2.0, high=500.0, meaning="its frequency", tried=_BAND, refines=True),
        _zeta("pair_zeta"),
    )

    def passed(name: str, d: ca.SX, s: Scope) -> ca.SX:
        w0, w, rate = 2 * ca.pi * s.p("pair_f"), s.x(name), s.x(f"{name}_rate")
        s.rate(name, w0 * rate)
        s.rate(f"{name}_rate", w0 * (d - w - 2 * s.p("pair_zeta") * rate))
        return d + s.p("pair_gain1") * w + s.p("pair_gain2") * rate

    return _filtered(effect, "linear pair", "pair", passed, numbers, ["", "_rate"])


def _filtered(
    effect: Effect,
    words: str,
    kind: str,
    passed: _Filter,
    numbers: Sequence[EffectNumber],
    suffixes: Sequence[str],
) -> Effect:
    """The effect with a filter on each part; its states are named `kind`_slot and the part's number, with suffixes."""
    if repeated := [slot for slot in effect.laws if PASSAGES[slot].repeated]:
        raise InputError(f'{effect.title}: slot {repeated[0]} is passed twice and takes no state for "{words}"')
    states = [
        state(f"{kind}_{slot}{index + 1}{suffix}", part.unit, part.scale, part.start if suffix != "_rate" else 0.0)
        for slot, index, part in passing_parts(effect)
        for suffix in suffixes
    ]
    if not states:
        raise InputError(f'{effect.title}: nothing passes its slots that "{words}" could filter')

    def change(slot: str) -> Change:
        return lambda index, d, s: passed(f"{kind}_{slot}{index + 1}", d, s)

    return put_on(effect, words, lambda slot, law: changed_output(slot, law, change(slot)), numbers, states)
