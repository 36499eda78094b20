"""`jackbench valve-test CAMPAIGN|RIG`: the sheet of a valve, in the manner of ISO 10770-1."""
