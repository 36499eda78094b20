"""`jackbench serve RIG`: a rig behind a wire, as a process on UDP, until Ctrl-C.

options     what it is asked
config      the rig as it is served
study       the service: address, page, and what it leaves
figures     times as a histogram has them
page        the page on which the rig is seen live; assets has its script and its style
"""
