"""The 7200GS with SI-M card, as its manual describes it (sections 4, 5, 9 and 10).

Where the manual is silent the simulator takes the case that is worse for a master: a run bit that stays
set starts the motor again as soon as the fault is reset. Multi-step speeds by the terminals 5 to 8, jog,
PID and automatic restart are not modelled; their registers are there and do nothing.
"""
