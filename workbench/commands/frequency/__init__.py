"""`jackbench frequency CAMPAIGN|SHEET.csv --output SIGNAL`: a measured frequency response beside the model's."""
