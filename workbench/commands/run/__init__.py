"""`jackbench run EXPERIMENT`.

paper               the paper's figures
steps               step experiments and their report
corrector           correctors in the spool loop
automatic_config, automatic    automatic tuning runs on a set of rigs and on drawn plants
platform_config, platform_study, platform_page    six jacks under one platform
"""
