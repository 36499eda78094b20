"""jackbench's workbench."""
