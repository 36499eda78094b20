"""`jackbench trace CAMPAIGN`: the residual of a campaign, traced to what the model lacks."""
