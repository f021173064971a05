"""A world in a box: the whole core with lines, drives, clients, disk and crashes, in virtual time.

    python -m tests.prove --minutes 30       # worlds from many seeds on all processors; writes docs/proof.md
    python -m tests.prove --seed 17          # one world, played again

A `scene` is drawn from a seed: what there is, which faults are in the air, what happens when. A `box` plays
it.
`observers` look at what is seen on the wires, told to clients and flushed to the disk, never into the core,
so that a fault of the core cannot hide itself.
"""
