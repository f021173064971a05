"""YAML text to a tree of marked texts. The only home of PyYAML.

Only the parser's events are used: nothing is constructed, so no scalar is ever guessed to be a number,
a date or a truth value, and no tag or alias can do anything. Everything that YAML offers beyond tables,
lists and scalars is refused.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import yaml

from gateway.mapping.finding import Finding, in_order
from gateway.mapping.node import Mark, Node
from gateway.mapping.syntax import in_words

MAX_CHARACTERS = 512 * 1024
MAX_DEPTH = 20
LIKE = "like"
"""The key of a file that starts from another one; only there does ``null`` mean something."""
_ABSENT = ("", "~", "null", "Null", "NULL")


class _TooDeepError(Exception):
    """Raised to leave a document that nests beyond `MAX_DEPTH`."""


def read(data: bytes, file: str) -> tuple[Node | None, list[Finding]]:
    """The tree of a file, and everything that is wrong with its form.

    The tree is None when the text cannot be taken apart at all; otherwise it is complete but for the
    parts that were complained about.
    """
    reader = _Reader(file)
    text = reader.decode(data)
    root = reader.compose(reader.without_tabs(text)) if text is not None else None
    reader.findings += reader.absent
    if root is None or root.child(LIKE) is None:
        reader.findings += reader.removed
    return root, in_order(reader.findings)


class _Reader:
    """Builds the tree of one file out of the parser's events."""

    def __init__(self, file: str) -> None:
        self.file = file
        self.findings: list[Finding] = []
        self.removed: list[Finding] = []
        """Complaints about each ``null`` in a table, which hold unless the file starts from another."""
        self.absent: list[Finding] = []
        """Complaints about places where nothing stands."""
        self.tabs: set[int] = set()
        """The lines with a tab."""
        self.events: Iterator[Any] = iter(())
        self._anchored: dict[str, str] = {}

    def complain(self, mark: Mark, message: str, remedy: str) -> None:
        self.findings.append(Finding("error", self.file, *mark, message, remedy))

    def decode(self, data: bytes) -> str | None:
        """The text of the file; None when it is no UTF-8 or too long."""
        if len(data) > MAX_CHARACTERS:
            self.complain((1, 1), f"the file is longer than {MAX_CHARACTERS} bytes", "split or shorten it")
            return None
        try:
            return data.decode("utf-8-sig")
        except UnicodeDecodeError as error:
            line = data.count(b"\n", 0, error.start) + 1
            self.complain((line, 1), "this line is not UTF-8 text", "save the file as UTF-8")
            return None

    def without_tabs(self, text: str) -> str:
        """The text with tabs as blanks; the first tab of each line is an error."""
        for number, line in enumerate(text.splitlines(), 1):
            if "\t" in line:
                self.complain((number, line.index("\t") + 1), "a tab stands here", "use blanks")
                self.tabs.add(number)
        return text.replace("\t", " ")

    def compose(self, text: str) -> Node | None:
        """The tree of the text's one document; None when the text is not YAML or nests too deep."""
        self.events = iter(yaml.parse(text, Loader=yaml.SafeLoader))
        try:
            return self._document()
        except yaml.MarkedYAMLError as error:
            self._misspelled(error)
        except yaml.reader.ReaderError as error:
            line = text.count("\n", 0, error.position) + 1
            self.complain((line, 1), "this line holds a character that may not stand in YAML", "remove it")
        except _TooDeepError:
            pass
        return None

    def _misspelled(self, error: yaml.MarkedYAMLError) -> None:
        """Say in words of people what the parser does not understand, unless a tab explains it. Where nothing
        stands, something may do so once the text is YAML."""
        self.absent, self.removed = [], []
        mark = error.problem_mark or error.context_mark
        spot = (mark.line + 1, mark.column + 1) if mark else (1, 1)
        if not any(line <= spot[0] for line in self.tabs):
            start = error.context_mark.line + 1 if error.context_mark else spot[0]
            self.complain(spot, *in_words(str(error.problem), start))

    def _document(self) -> Node | None:
        root: Node | None = None
        for event in self.events:
            if isinstance(event, yaml.DocumentStartEvent):
                if root is not None:
                    self.complain(_mark(event), "a second document starts here", "use one file for each")
                    break
                root = self._node(next(self.events), 0)
        if root is None and not (self.findings or self.absent):
            self.complain((1, 1), "the file is empty", "write something into it")
        return root

    def _node(self, event: Any, depth: int) -> Node | None:
        """The node that starts with ``event``; None where nothing stands."""
        if depth > MAX_DEPTH:
            self.complain(_mark(event), f"nested deeper than {MAX_DEPTH} levels", "flatten it")
            raise _TooDeepError
        self._refuse(event)
        if isinstance(event, yaml.AliasEvent):
            return self._alias(event)
        if isinstance(event, yaml.MappingStartEvent):
            return self._table(event, depth)
        if isinstance(event, yaml.SequenceStartEvent):
            return self._list(event, depth)
        return self._scalar(event)

    def _refuse(self, event: Any) -> None:
        """Complain about aliases, anchors and tags. What they stand before is read all the same."""
        if isinstance(event, yaml.AliasEvent) or event.anchor is not None:
            what = "alias" if isinstance(event, yaml.AliasEvent) else "anchor"
            self.complain(_mark(event), f"the {what} `{event.anchor}` is not allowed", "write it out")
        elif event.tag is not None and event.tag != "!":
            self.complain(_mark(event), f"the tag `{event.tag}` is not allowed", "remove it")

    def _alias(self, event: yaml.AliasEvent) -> Node:
        """The value that an alias repeats; a table or list is not repeated, however small it looks."""
        text = self._anchored.get(str(event.anchor))
        return Node(*_mark(event), text if text is not None else {}, file=self.file, blind=text is None)

    def _scalar(self, event: yaml.ScalarEvent) -> Node | None:
        if event.style is None and event.value in _ABSENT:
            self.absent.append(self._absence(event))
            return None
        if event.anchor is not None:
            self._anchored[event.anchor] = event.value
        return Node(*_mark(event), event.value, file=self.file)

    def _absence(self, event: Any) -> Finding:
        remedy = "write a value, or leave the key out"
        return Finding("error", self.file, *_mark(event), "nothing stands here", remedy)

    def _list(self, start: Any, depth: int) -> Node:
        items: list[Node] = []
        refused: list[Node] = []
        while not isinstance(event := next(self.events), yaml.SequenceEndEvent):
            item = self._node(event, depth + 1)
            if item is None:
                refused.append(Node(*_mark(event), "", file=self.file))
            else:
                items.append(item)
        return Node(*_mark(start), items, file=self.file, refused=refused)

    def _table(self, start: Any, depth: int) -> Node:
        table = Node(*_mark(start), {}, file=self.file)
        while not isinstance(event := next(self.events), yaml.MappingEndEvent):
            key = self._node(event, depth + 1)
            following = next(self.events)
            if _is_null(following):
                self.removed.append(self._absence(following))
                value = None
            else:
                value = self._node(following, depth + 1)
            self._enter(table, key, value, _mark(event))
        return table

    def _enter(self, table: Node, key: Node | None, value: Node | None, mark: Mark) -> None:
        """Put a key and its value into a table, or complain about the key."""
        assert isinstance(table.value, dict)
        if key is None:
            return
        if not isinstance(key.value, str):
            self.complain(mark, "a key must be one word", "write `name: value`")
            table.refused.extend([key, *([value] if value is not None else [])])
        elif key.value in table.keys:
            line = table.keys[key.value][0]
            self.complain(mark, f"the key `{key.value}` stands here twice", f"the first is in line {line}")
            table.refused.extend([value] if value is not None else [])
        else:
            table.keys[key.value] = mark
            if value is not None:
                table.value[key.value] = value


def _is_null(event: Any) -> bool:
    """True for a plain ``null``, written out."""
    plain = isinstance(event, yaml.ScalarEvent) and event.style is None
    return plain and (event.anchor, event.tag) == (None, None) and event.value in _ABSENT[1:]


def _mark(event: Any) -> Mark:
    return event.start_mark.line + 1, event.start_mark.column + 1
