"""A line in a storm: everything that can go wrong on a wire at once, in virtual time, from a seed.

Written from the standard apart from `gateway.modbus`. Registers hold values that tell their unit, their
address and when they were read, so that no wrong or old value can pass for a right one.

    python -m tests.line.storm --transactions 1000000 --seed 1
"""
