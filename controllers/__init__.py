"""Controllers, one file each, all after the protocol of workbench.controller."""
