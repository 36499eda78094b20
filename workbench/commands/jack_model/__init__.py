"""`jackbench jack-model EXPERIMENT`: the jack in six numbers, with the compensators of each controller closed."""
