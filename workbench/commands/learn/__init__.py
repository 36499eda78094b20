"""`jackbench learn EXPERIMENT`: the drive file of a record that a loop plays again and again."""
