"""Fuzzing of the framings: what a line may bring, and what may be made of it.

`python -m tests.modbus.fuzz FRAMING --inputs 1000000 --seed 7` runs longer than `make test` does.
"""
