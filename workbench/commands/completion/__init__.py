"""`jackbench completion bash|zsh|fish`.

answers    what a shell is answered that asks for the end of a word
"""
