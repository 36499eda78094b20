"""`jackbench serve RIG`: a rig behind a wire, as a process on UDP, until Ctrl-C.

options     what it is asked
config      the rig as it is served
study       the service: address, page, and what it leaves; assets has the script and the style of the page
figures     times as a histogram has them
"""
