"""`jackbench trace CAMPAIGN`: the residual of a campaign, traced to what the model lacks.

answer, metrics           the answer as an object and as plain numbers
learned_page              what was learned, beside the library's formulas
words, cautions, effect_words, tables    what the report is made of
explained   what effects explain of what a model misses
next_record    what to record next, and the channel that shows it
told        which effects a closed loop lets through
reasons     what the rule says of a candidate, and the numbers by which it does
without     names of effects that are not to be tried
platform    the campaign of a platform, leg by leg
payload     what is another number of a platform's payload
when_new    what differs from a valve's sheet when it was new
sheets, sheet_files, sheet_page    the same of frequency-response sheets

What is computed after a trace, for its report and its answer, is in identify/found, and what to record next in
identify/plan.
"""
