"""`jackbench train EXPERIMENT`: a policy searched by evolution, on the goals and the envelope of a search.

options    a tune experiment with a network, and what the command is asked
start              the network that it starts from
policies           the policies of several runs, judged beside the law that they stand on
unseen             on plants that no run has seen
study, page        all runs, and the file that the others take; the report
"""
