"""What a trace says of how far it is: steps that are numbered honestly, and a time left that can be believed."""

import re

from workbench.identify.trace.steps import TraceProgress


class Told:
    """Lines that were said, and a clock that is moved by hand."""

    def __init__(self):
        self.lines: list[str] = []
        self.now = 0.0
        self.steps = TraceProgress(self.lines.append, lambda: self.now)

    def items(self, durations):
        """Do items that last so long; the times left that were said, and those that were true."""
        pairs = []
        for place, duration in enumerate(durations):
            self.steps.say("an item")
            if found := re.search(r"about (\d+) s left", self.lines[-1]):
                pairs.append((float(found[1]), sum(durations[place:])))
            self.now += duration
            self.steps.done()
        return pairs


def test_the_time_left_is_right_within_a_factor_of_two_where_items_are_alike():
    told = Told()
    told.steps.begin("the rig alone", "fits")
    told.items([5.0])
    told.steps.begin("candidates", "fits", items=9)
    pairs = told.items([4.0, 7.0, 5.0, 3.0, 6.0, 8.0, 4.0, 5.0, 6.0])
    assert len(pairs) == 9
    assert all(0.5 <= said / true <= 2 for said, true in pairs)


def test_nothing_is_said_of_what_was_never_done_and_read_back_stages_tell_nothing():
    told = Told()
    told.steps.begin("candidates", "fits", items=3)
    assert told.items([0.001, 0.001, 6.0]) == []
    told.steps.begin("pairs", "fits", items=2)
    assert told.lines[-1].endswith("about 12 s left")


def test_steps_are_counted_on_and_the_number_of_all_never_falls():
    told = Told()
    for ahead in (1, 3, 2, 1, 0, 2, 0):
        told.steps.begin("something", "things", ahead=ahead)
    counts = [tuple(map(int, re.findall(r"\d+", line))) for line in told.lines]
    assert [number for number, *_ in counts] == [1, 2, 3, 4, 5, 6, 7]
    least = [known for _, *rest in counts for known in rest]
    assert least == sorted(least)
    assert all(number < known for number, *rest in counts for known in rest)
    assert told.lines[3:5] == ["step 4 of at least 5: something", "step 5: something"]


def test_a_step_after_all_that_are_known_of_is_not_one_of_at_least_itself():
    told = Told()
    told.steps.begin("something", "things")
    assert told.lines == ["step 1: something"]


def test_more_items_than_were_planned_are_counted():
    told = Told()
    told.steps.begin("candidates", "fits", items=1)
    told.items([10.0])
    told.steps.remain(5)
    told.steps.say("formulas")
    assert told.lines[-1].endswith("about 50 s left")
