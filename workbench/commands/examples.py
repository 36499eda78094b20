"""Command lines as people type them: two of each command for its --help, and the five that people begin with."""

FIRST = {
    "jackbench run first_loop": "close a position loop on a jack, and see its step and its margins",
    "jackbench import rec.csv --rig jack-10t": "make a campaign of your own recordings",
    "jackbench trace sample": "find out why model and recordings disagree, here on bundled recordings",
    "jackbench new mine": "make a folder of your own: a rig, experiments, a campaign, a controller",
    "jackbench coefficients position_crone --out out/c": "leave a controller in C and in Structured Text",
}

EXAMPLES: dict[str, tuple[str, str]] = {
    "new": ("jackbench new mine", "jackbench new mine --ask two-stage"),
    "list": ("jackbench list experiments", "jackbench list controllers --json"),
    "show": ("jackbench show jack-10t", "jackbench show jack-10t --out mine.toml"),
    "open": ("jackbench open", "jackbench open out/trace-sample"),
    "doctor": ("jackbench doctor", "jackbench doctor --json"),
    "completion": ('eval "$(jackbench completion bash)"', "jackbench completion fish | source"),
    "trust": ("jackbench trust friction.py", "jackbench trust effects/seal.py effects/hose.py"),
    "run": ("jackbench run position_step", "jackbench run mine/step.toml --rig mine/rig.toml --out out/mine"),
    "bench": ("jackbench bench benchmark", "jackbench bench benchmark --rig mine.toml --jobs 4"),
    "compare": (
        "jackbench compare out/before out/after",
        "jackbench compare out/p out/crone out/mpc --picture steps.png",
    ),
    "robustness": ("jackbench robustness robustness", "jackbench robustness robustness --plants 1000 --jobs 2"),
    "limit": ("jackbench limit benchmark", 'jackbench limit position_step --margin "20 bar"'),
    "faults": ("jackbench faults faults", "jackbench faults faults --plants 100"),
    "tune": ("jackbench tune tune_p_dp", "jackbench tune tune_p_dp --rig mine.toml --out out/tuned"),
    "train": ("jackbench train train_p_dp", "jackbench train train_p_dp --jobs 2"),
    "live": ("jackbench live position_step", "jackbench live tune_p_dp --port 8080"),
    "learn": ("jackbench learn learn_sine", "jackbench learn learn_road --plants 100"),
    "inverse": ("jackbench inverse inverse", "jackbench inverse inverse_hybrid"),
    "sines": ("jackbench sines sines", "jackbench sines sines --plants 100"),
    "time": ("jackbench time position_mpc", "jackbench time benchmark --out out/timed"),
    "spread": ("jackbench spread position_crone", "jackbench spread position_crone --json"),
    "jack-model": ("jackbench jack-model position_crone", "jackbench jack-model position_crone --json"),
    "new-rig": ("jackbench new-rig new_rig", "jackbench new-rig datasheet.toml --out out/mine"),
    "import": (
        "jackbench import rec.csv --rig jack-10t",
        "jackbench import monday/*.tdms --rig mine.toml --out monday",
    ),
    "record": ("jackbench record jack-10t --seed 1", "jackbench record mine.toml --at udp://192.168.0.20:4000"),
    "excite": (
        "jackbench excite jack-10t multisine --amplitude 0.1 --seconds 20 --band 0.5 100 --out noise.csv",
        "jackbench excite jack-10t valve-test --out valve",
    ),
    "residual": ("jackbench residual sample", "jackbench residual campaign --rig found.toml --free-run"),
    "fit": ("jackbench fit sample", "jackbench fit campaign --starts 1 --rig-out found.toml"),
    "trace": (
        "jackbench trace sample",
        'jackbench trace maker.csv --output spool --amplitude "100 %" --rig jack-10t',
    ),
    "plan": ("jackbench plan sample", "jackbench plan campaign --for valve-test"),
    "frequency": (
        "jackbench frequency sample --output position",
        "jackbench frequency maker.csv --output spool --amplitude 1 --rig jack-10t",
    ),
    "retune": (
        "jackbench retune tune_p_dp --found out/trace-sample/rig.toml",
        "jackbench retune tune_p_dp --found found.toml --designs 100",
    ),
    "watch": ("jackbench watch rig-3", 'jackbench watch rig-3 --false-alarms "1 per 5 years" --exit-code'),
    "capability": (
        "jackbench capability jack-10t --loop position_tuned --pdf",
        "jackbench capability jack-10t --drive course.csv --cooler '20 kW' --catalogue catalogue.toml",
    ),
    "force-test": (
        "jackbench force-test jack-10t --specimen '1e7 N/m' --grips '20 kg'",
        "jackbench force-test campaign --within 1 --pdf",
    ),
    "valve-test": ("jackbench valve-test jack-10t", "jackbench valve-test campaign --rig mine.toml --pdf"),
    "coefficients": (
        "jackbench coefficients position_crone --out out/c",
        "jackbench coefficients position_crone --json",
    ),
    "fmu": ("jackbench fmu jack-10t", "jackbench fmu jack-10t --controller position_tuned:p-dp --out loop"),
    "serve": ("jackbench serve jack-10t --lockstep", "jackbench serve jack-10t --realtime --rate 1000 --port 4000"),
    "drive": (
        "jackbench drive first_loop --at udp://127.0.0.1:4000",
        "jackbench drive position_tuned --at udp://127.0.0.1:4000 --controller p-dp",
    ),
    "commission": (
        "jackbench commission jack-10t --at udp://127.0.0.1:4000",
        "jackbench commission mine.toml --at udp://192.168.0.20:4000 --minutes 10",
    ),
    "speed": ("jackbench speed", "jackbench speed --link"),
}


def help_text(name: str) -> str:
    """What stands below the options of a command's --help: examples, and its page."""
    lines = "\n".join(f"  {line}" for line in EXAMPLES[name])
    page = f"reference/commands.html#jackbench-{name}"
    return f"examples:\n{lines}\n\npage: {page} of the site, which `make docs` builds"
