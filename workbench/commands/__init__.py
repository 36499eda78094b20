"""The commands, one folder each, and `common`, what they share.

A command's folder has `options.py` (what it is asked, and how the study is called) and `study.py` (a configuration in,
metrics, tables and a page out). Where it reads a file of its own there is a `config.py`, and where its report is more
than a few lines a `page.py`. The command line imports the chosen command only.

examples     two command lines of each command, which its --help prints, and those that people begin with
"""

from keyword import iskeyword

GROUPS: dict[str, dict[str, str]] = {
    "start": {
        "new": "make a starter folder: a rig, experiments, a campaign, a controller",
        "list": "list what there is",
        "show": "show a rig and what follows from its numbers",
        "open": "open a report in the browser: of a run, or the newest",
        "doctor": "say what this installation can do, and what is missing",
        "completion": "print what completes the command line in bash, zsh or fish",
        "trust": "let code that comes with a rig run",
    },
    "design": {
        "run": "run an experiment file",
        "bench": "controllers on a set of rigs in scenarios",
        "compare": "hold finished runs against each other",
        "robustness": "every controller on thousands of drawn plants",
        "limit": "the soonest that the known rig settles, whatever controls it",
        "knowledge": "what knowing a rig's numbers better is worth to its controllers, in seconds",
        "faults": "what the guard makes of faults of sensors, controllers, drives and plants",
        "tune": "search a controller's numbers: hard goals over a set of rigs, then the least cost",
        "train": "search a policy, a small network on a controller, by evolution: goals and envelope as of tune",
        "live": "a page on which a loop's numbers are dragged, and it answers at once",
        "learn": "learn the drive file of a record that a loop plays again and again",
        "inverse": "design an inverse before a loop; judge a loop that closes through its reference",
        "sines": "amplitude and phase control of sines, with their harmonics taken out",
        "time": "how long controllers compute, and an experiment that knows it",
        "spread": "how the overshoot spreads over gain, speed, mass, oil and specimen",
        "jack-model": "the jack in six numbers, as CRONE and LQG take it",
        "new-rig": "build a rig from a datasheet",
    },
    "diagnose": {
        "import": "make a campaign folder of recordings as labs leave them",
        "record": "record a rig, in simulation or live on UDP",
        "excite": "design an excitation that a rig can play",
        "residual": "hold a rig's model against recordings",
        "fit": "fit a rig's numbers to recordings",
        "trace": "why do model and rig disagree",
        "plan": "what to record next, to tell effects apart and to see numbers",
        "frequency": "measured frequency response of a pair of signals, beside the model's",
        "retune": "tune a controller anew on a rig as found: what that buys",
        "watch": "a rig over months: which number or effect changes, since when, what it costs a loop",
        "valve-test": "the sheet of a valve: flow, gains, lap, hysteresis, steps, frequency response, with limits",
        "capability": "the sheet of what a rig can do: its envelope over frequency, what binds, heat, sizing",
        "force-test": "the sheet of a load cell: its errors at rest and in motion, and what compensation leaves",
    },
    "deliver": {
        "coefficients": "second-order sections and a test vector, for a rig's own digital controller",
        "fmu": "a rig, with a controller where asked, as an FMU for other simulators",
        "serve": "serve a rig on UDP, in lockstep or real time, for controllers behind a wire",
        "drive": "play an experiment's controllers at a live rig on UDP, judged as run does",
        "commission": "from a datasheet to a verified controller on a live rig: look, record, trace, tune, verify",
    },
    "study": {
        "trace-study": "how often is a trace right",
        "watch-study": "how well are made rigs watched over months",
        "commission-study": "how well are hidden rigs commissioned",
        "speed": "time the engine beside public solvers",
    },
}  # what a person is at: a command has its place in one of them
COMMANDS = {name: what for group in GROUPS.values() for name, what in group.items()}


def folder(name: str) -> str:
    """The folder of a command."""
    plain = name.replace("-", "_")
    return f"{plain}_" if iskeyword(plain) else plain
