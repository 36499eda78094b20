"""JackBench-v0: what a policy adds to a tuned law, rewarded as a bench judges it.

environments     the single and the vector environment, documented as Gymnasium does
task             law, plants, scenarios, weights and goals of a train experiment
core             its episodes in N lanes of the law's compiled loop: what a policy is shown, what it is charged
baselines        episodes under other controllers and policies
export           an actor of Stable-Baselines3 as policy.npz, with the experiment that runs it
"""
