"""What is wrong with the spelling of a file that is not YAML, in words of people. Pure."""

from __future__ import annotations

_KNOWN: tuple[tuple[str, str, str], ...] = (
    (
        "mapping values are not allowed",
        "a `: ` stands where none can",
        "put the text in quotes, or begin the line under those that it stands with",
    ),
    ("<block end>, but found '}'", "a } too many", "remove it"),
    ("<block end>, but found ']'", "a ] too many", "remove it"),
    ("<block end>, but found '<scalar>'", "more text behind a closed quote", "put all of it in quotes"),
    (
        "expected <block end>",
        "this line begins neither under those of its table nor under the table's key",
        "correct the blanks at its start",
    ),
    ("sequence entries are not allowed", "a list begins here in the middle of a line", "begin a line with -"),
    ("expected ',' or '}'", "a , is missing here, or the } of line {line}", "write it"),
    ("expected ',' or ']'", "a , is missing here, or the ] of line {line}", "write it"),
    ("could not find expected ':'", "the key of line {line} has no `: ` behind it", "write `name: value`"),
    ("cannot start any token", "this character cannot begin a text", "put the text in quotes"),
    ("end of stream", "the quote of line {line} is not closed", "close it"),
    ("unknown escape", "a \\ means something in double quotes", "use single quotes"),
)
"""Part of what the parser says, and the same in words; ``{line}`` is where the trouble began."""


def in_words(problem: str, line: int) -> tuple[str, str]:
    """Message and remedy for what the parser complains about."""
    for part, message, remedy in _KNOWN:
        if part in problem:
            return f"not YAML: {message.replace('{line}', str(line))}", remedy
    return f"not YAML: {problem}", "correct the spelling before this place"
