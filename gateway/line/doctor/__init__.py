"""The line doctor: figures of a line and its units, and what is wrong with the line, in plain terms. Pure.

`figures` counts what happened, `chart` keeps what matters for a diagnosis of the last half minute, `rules`
tell one illness from another, and `doctor` is what a line talks to. Words for people are made where names are
known, in `gateway.core.condition`.
"""
