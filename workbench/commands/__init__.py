"""The commands, one folder each, and `common`, what they share.

A command's folder has `options.py` (what it is asked, and how the study is called) and `study.py` (a configuration in,
metrics, tables and a page out). An experiment of its own is declared in its options; where its report is more
than a few lines a `page.py`. The command line imports the chosen command only.

examples     two command lines of each command, which its --help prints, and those that people begin with
"""

from keyword import iskeyword

GROUPS: dict[str, dict[str, str]] = {
    "start": {
        "new": "make a starter folder: a rig, experiments, a campaign, a controller",
        "list": "list what there is",
        "show": "show a rig and what follows from its numbers",
        "open": "open the report of a run, or the newest one, in the browser",
        "doctor": "say what this installation can do, and what is missing",
        "speed": "time the engine beside public solvers",
        "completion": "print the script that completes commands in bash, zsh or fish",
        "trust": "allow code that comes with a rig to run",
    },
    "design": {
        "run": "run an experiment file",
        "bench": "play controllers on a set of rigs in scenarios",
        "compare": "compare finished runs side by side",
        "robustness": "judge every controller on thousands of drawn plants",
        "limit": "compute how soon an optimiser that knows the rig settles it",
        "faults": "play faults of sensors, controllers, drives and plants, and judge the guard",
        "tune": "search a controller's numbers: hard goals over a set of rigs, then the least cost",
        "train": "search a policy, a small network on top of a controller, with the goals and envelope of tune",
        "live": "open a page on which you drag a loop's numbers and see the answer at once",
        "learn": "learn the drive file of a record that a loop plays again and again",
        "inverse": "design an inverse before a loop; judge a loop that closes through its reference",
        "sines": "control amplitude and phase of sines, and take out their harmonics",
        "time": "measure the computing time of controllers, and leave an experiment that includes it",
        "spread": "show how the overshoot spreads over gain, speed, mass, oil and specimen",
        "jack-model": "print the six numbers of the jack that CRONE and LQG take",
        "new-rig": "build a rig from a datasheet",
    },
    "diagnose": {
        "import": "make a campaign folder of recordings as labs leave them",
        "record": "record a rig, in simulation or live on UDP",
        "excite": "design an excitation that a rig can play",
        "residual": "compare a rig's model with recordings",
        "fit": "fit a rig's numbers to recordings",
        "trace": "find out why model and rig disagree",
        "plan": "say what to record next, to tell effects apart and to see numbers",
        "frequency": "measure the frequency response of a pair of signals, beside the model's",
        "retune": "tune a controller anew on a found rig, and say what it gains",
        "watch": "watch a rig over months: which number or effect changes, since when, what a loop loses",
        "valve-test": "make the sheet of a valve: flow, gains, lap, hysteresis, steps, frequency response, with limits",
        "capability": "make the sheet of a rig's capability: envelope over frequency, what binds it, heat, sizing",
        "force-test": "make the sheet of a load cell: errors at rest, in motion, and after compensation",
    },
    "deliver": {
        "coefficients": "export a controller as sections, C and Structured Text, with test vectors",
        "fmu": "export a rig, with or without a controller, or a platform as an FMU for other simulators",
        "serve": "serve a rig on UDP, in lockstep or real time, for controllers behind a wire",
        "drive": "play an experiment's controllers at a live rig on UDP, and judge them as run does",
        "commission": "bring a live rig from its datasheet to a verified controller",
    },
}  # what a person is at: a command has its place in one of them
STUDIES = {f"{name}-study": name for name in ("trace", "watch", "commission", "sheet")} | {"knowledge": "knowledge"}
COMMANDS = {name: what for group in GROUPS.values() for name, what in group.items()}


def folder(name: str) -> str:
    """The folder of a command."""
    plain = name.replace("-", "_")
    return f"{plain}_" if iskeyword(plain) else plain
