"""Why do model and rig disagree? A campaign traced to what the model lacks. One learns trace and its answer."""

from pathlib import Path

import workbench as wb

sample = Path(__file__).parents[1] / "experiments" / "sample"
candidates = {"jack.leakage", "jack.friction"}  # the whole library takes a minute
others = {effect.name for effect in wb.known_effects()} - candidates

answer = wb.trace(sample, without=sorted(others))

Path("out").mkdir(exist_ok=True)
answer.outcome.plot().save("out/trace.png")
print(answer)
print(answer.ranking[0]["effect"], "explains", f"{answer.ranking[0]['explained']:.1%}")
wb.save_rig(answer.rig, Path("out/rig_as_found.toml"))
