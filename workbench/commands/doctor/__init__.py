"""`jackbench doctor`.

checks    what is looked at: libraries, optional groups, machine code, a C compiler, folders, cores
"""
