"""`jackbench coefficients EXPERIMENT`: discrete coefficients of its controllers at the rig's period."""
