"""`jackbench time EXPERIMENT`: times its controllers and leaves timed.toml with their computing delays."""
