"""`jackbench trace CAMPAIGN`: the residual of a campaign, traced to what the model lacks.

answer, metrics           the answer as an object and as plain numbers
alike                     what explains as much as another value of a described number
steps                     held-out free runs, effect by effect
shape                     what an unknown disturbance looks like
law_curves, learned_page  what was learned: curves and gains with their band, beside the library's formulas
detectability             what would show if it were there
words, effect_words, tables, figures    what the report is made of
without     names of effects that are not to be tried
platform, legs, legs_page    the campaign of a platform, leg by leg
payload     what is another number of a platform's payload
when_new    what differs from a valve's sheet when it was new
sheets, sheet_files, sheet_page    the same of frequency-response sheets
"""
