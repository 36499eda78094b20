"""`jackbench trace CAMPAIGN`: the residual of a campaign, traced to what the model lacks.

answer, metrics           the answer as an object and as plain numbers
shape                     what an unknown disturbance looks like
detectability             what would show if it were there
words, tables, figures    what the report is made of
sheets, sheet_page        the same of frequency-response sheets
"""
