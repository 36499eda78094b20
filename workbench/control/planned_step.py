"""One sample of a predictive law, written so that it runs in Python, and as C, Structured Text and machine code.

It is read by engine/kernel.py: numbers, arrays of a fixed size and loops, no calls but abs and sqrt. What is written in
capitals is a size, a place, or a table of the law's numbers, row after row. Every loop is bounded.
"""

# pyright: reportUndefinedVariable=false
# ruff: noqa: F821

from math import sqrt
from typing import Any

from ..engine.kernel import places, space


def planned_step(given: Any, found: Any) -> None:
    """What a law of a Kalman filter, a governor and a plan does at a sample.

    given: the filter's state [STATES], the last finite reference, the command before, what is measured [MEASURED], the
    references from now on [REFERENCES]. found: the command, whether the plan keeps every limit (1 or 0), the reference
    kept, and the filter's state after this period under a command of 0 [STATES]. Where another solver makes the plan,
    PLANS is 0 and SHOWN is LIMITS: then also the command without a plan, how many limits it passes, and what becomes
    of the limited signals [SHOWN].
    """
    state = space(STATES)
    wanted = space(REFERENCES)
    motion = space(ROWS)
    rest = space(LIMITS)
    change = space(CHANGES)
    off = space(STATES + REFERENCES + 1)

    # the filter: a sample with a signal that is not finite corrects nothing
    total = 0.0
    for j in range(MEASURED):
        total += given[SIGNALS + j]
    for i in range(STATES):
        state[i] = given[i]
    if abs(total) <= HUGE:
        for k in range(SEEN):
            gap = 0.0
            for j in range(MEASURED):
                gap += PICK[k * MEASURED + j] * given[SIGNALS + j]
            for i in range(STATES):
                gap -= OUTPUT[k * STATES + i] * given[i]
            for i in range(STATES):
                state[i] += GAIN[k * STATES + i] * gap

    # the references, within the stroke
    kept = given[ASKED]
    if abs(given[REFERENCE]) <= HUGE:
        kept = given[REFERENCE]
    stroke = STROKE[0]
    for i in range(REFERENCES):
        reference = given[REFERENCE + i]
        if not abs(reference) <= HUGE:
            reference = kept
        if reference > stroke:
            reference = stroke
        if reference < -stroke:
            reference = -stroke
        wanted[i] = reference
    command = 0.0
    for i in range(REFERENCES):
        command += FOLLOW[i] * wanted[i]
    for i in range(STATES):
        command -= FEEDBACK[i] * state[i]

    # how far state, references and last command are off a rest: a bound on all that is limited, which is mostly enough
    before = given[SENT]
    for i in range(STATES):
        off[i] = abs(state[i] - RESTING[i] * wanted[0])
    off[STATES] = abs(wanted[0])
    for i in range(1, REFERENCES):
        off[STATES + i] = abs(wanted[i] - wanted[0])
    off[STATES + REFERENCES] = abs(before - command)
    passed = 0
    for j in range(GROUPS):
        bound = 0.0
        for i in range(STATES + REFERENCES + 1):
            bound += BOUNDS[j * (STATES + REFERENCES + 1) + i] * off[i]
        if not bound <= 1.0:
            passed += 1

    # the governor: the least shift of the references with which the predicted motion keeps the stroke
    shifted = 0
    if passed > 0:
        for j in range(ROWS):
            value = MOVED[j] * wanted[0]
            for i in range(STATES):
                value += MOTION[i * ROWS + j] * state[i]
            motion[j] = value
        for i in range(1, REFERENCES):
            for j in range(ROWS):
                motion[j] += MOVED[i * ROWS + j] * wanted[i]
        for j in range(ROWS):
            if not abs(motion[j]) <= ROOM[j]:
                shifted += 1
    if shifted > 0:
        least = -HUGE
        most = HUGE
        for j in range(ROWS):
            low = (-ROOM[j] - motion[j]) / ANSWERS[j]
            high = (ROOM[j] - motion[j]) / ANSWERS[j]
            if low > least:
                least = low
            if high < most:
                most = high
        shift = 0.0
        if least > 0.0:
            shift = least
        if shift > most:
            shift = most
        for i in range(REFERENCES):
            reference = wanted[i] + shift
            if reference > stroke:
                reference = stroke
            if reference < -stroke:
                reference = -stroke
            command += FOLLOW[i] * (reference - wanted[i])
            wanted[i] = reference

    # what becomes of the limited signals, each over its limit, without a change
    if passed > 0:
        passed = 0
        for j in range(LIMITS):
            value = BEFORE[j] * before + LED[j] * wanted[0]
            for i in range(STATES):
                value += COURSE[i * LIMITS + j] * state[i]
            rest[j] = value
        for i in range(1, REFERENCES):
            for j in range(LIMITS):
                rest[j] += LED[i * LIMITS + j] * wanted[i]
        for j in range(LIMITS):
            if not abs(rest[j]) <= 1.0:
                passed += 1

    # the plan: the least changes with which they keep their limits, by a dual active set (Goldfarb and Idnani, 1983)
    arrived = 1.0
    looked = 0.0
    if passed > 0:
        looked = 1.0
    for j in range(SHOWN):
        found[3 + STATES] = command
        found[4 + STATES] = looked
        found[5 + STATES + j] = rest[j]
    if passed > 0 and PLANS > 0:
        free = space(LIMITS)
        held = places(LIMITS)
        limit = places(ACTIVE + 1)
        side = space(ACTIVE + 1)
        price = space(ACTIVE + 1)
        factor = space(ACTIVE * ACTIVE)
        within = space(ACTIVE + 1)
        answer = space(ACTIVE + 1)
        for j in range(LIMITS):
            free[j] = rest[j]
            held[j] = 0
        count = 0
        turns = 0.0
        pending = 0
        searching = 1
        while searching > 0:
            # the limit that is passed by most
            worst = TOLERANCE
            row = -1
            for j in range(LIMITS):
                over = abs(rest[j]) - 1.0
                if over > worst and held[j] < 1:
                    worst = over
                    row = j
            if row < 0:
                searching = 0
            adding = searching
            if adding > 0:
                limit[count] = row
                side[count] = 1.0
                if rest[row] < 0.0:
                    side[count] = -1.0
                price[count] = 0.0
            while adding > 0:
                # how the held limits answer to its price, and what is left of it
                turns += 1.0
                own = OWN[row]
                curve = own
                for i in range(count):
                    value = 0.0
                    for k in range(CHANGES):
                        value += REACH[k * LIMITS + limit[i]] * REACH[k * LIMITS + row]
                    value *= side[i] * side[count]
                    for k in range(i):
                        value -= factor[i * ACTIVE + k] * within[k]
                    value /= factor[i * ACTIVE + i]
                    within[i] = value
                    curve -= value * value
                for n in range(count):
                    i = count - 1 - n
                    value = within[i]
                    for k in range(i + 1, count):
                        value -= factor[k * ACTIVE + i] * answer[k]
                    answer[i] = value / factor[i * ACTIVE + i]
                step = HUGE
                if curve > DEPENDENT * own:
                    step = worst / curve
                drop = -1
                for i in range(count):
                    if answer[i] > 0.0 and price[i] < step * answer[i]:
                        step = price[i] / answer[i]
                        drop = i
                if step >= HUGE:
                    adding = 0
                    searching = 0
                    pending = 1
                    arrived = 0.0
                else:
                    for i in range(count):
                        price[i] -= step * answer[i]
                    price[count] += step
                    worst -= step * curve
                    if drop < 0:
                        # it is held from now on
                        for k in range(count):
                            factor[count * ACTIVE + k] = within[k]
                        factor[count * ACTIVE + count] = sqrt(curve)
                        held[row] = 1
                        count += 1
                        adding = 0
                        if count >= ACTIVE:
                            searching = 0
                            arrived = 0.0
                    else:
                        # a held limit whose price is 0 is let go, and those behind it move up
                        held[limit[drop]] = 0
                        for i in range(drop, count):
                            limit[i] = limit[i + 1]
                            side[i] = side[i + 1]
                            price[i] = price[i + 1]
                        count -= 1
                        for i in range(drop, count):
                            for n in range(i + 1):
                                value = 0.0
                                for k in range(CHANGES):
                                    value += REACH[k * LIMITS + limit[i]] * REACH[k * LIMITS + limit[n]]
                                value *= side[i] * side[n]
                                if n == i:
                                    value = OWN[limit[i]]
                                for k in range(n):
                                    value -= factor[i * ACTIVE + k] * factor[n * ACTIVE + k]
                                if n == i:
                                    factor[i * ACTIVE + i] = sqrt(value)
                                else:
                                    factor[i * ACTIVE + n] = value / factor[n * ACTIVE + n]
                    if turns >= TURNS[0]:
                        pending = adding
                        adding = 0
                        searching = 0
                        arrived = 0.0
            # the changes that these prices make, and what becomes of the signals with them
            for k in range(CHANGES):
                change[k] = 0.0
                for i in range(count + pending):
                    change[k] -= price[i] * side[i] * REACH[k * LIMITS + limit[i]]
            for j in range(LIMITS):
                rest[j] = free[j]
            for k in range(CHANGES):
                for j in range(LIMITS):
                    rest[j] += REACH[k * LIMITS + j] * change[k]
        command += change[0] * FIRST[0]

    # the command within its rate and its limit, which a sum in another order passes by a last bit
    if command > before + RATE[0]:
        command = before + RATE[0]
    if command < before - RATE[0]:
        command = before - RATE[0]
    if command > MOST[0]:
        command = MOST[0]
    if command < -MOST[0]:
        command = -MOST[0]
    found[0] = command
    found[1] = arrived
    found[2] = kept
    for i in range(STATES):
        value = 0.0
        for j in range(STATES):
            value += AHEAD[i * STATES + j] * state[j]
        found[3 + i] = value
