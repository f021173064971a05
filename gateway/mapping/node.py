"""A mapping file as a tree of texts that know where they stand."""

from __future__ import annotations

from dataclasses import dataclass, field

Path = tuple[str | int, ...]
"""The way from the root of a file to one value: keys of tables and indexes of lists."""

Mark = tuple[int, int]
"""Line and column, both counted from 1."""


@dataclass(frozen=True, slots=True)
class Node:
    """A scalar (its text), a list, or a table, and where it starts. ``keys`` tells where each key of a
    table stands; a key there without a value was written as ``null`` or refused."""

    line: int
    column: int
    value: str | list[Node] | dict[str, Node]
    keys: dict[str, Mark] = field(default_factory=dict)
    file: str = ""
    """The file that it stands in: with ``like``, the parts of one tree come from several."""
    refused: list[Node] = field(default_factory=list)
    """What stood in it and was refused: the second of two keys, an empty place in a list."""
    blind: bool = False
    """True when nobody can tell what stood here."""

    def child(self, part: str | int) -> Node | None:
        """The value under a key or index, None when there is none."""
        if isinstance(self.value, dict):
            return self.value.get(str(part))
        if isinstance(self.value, list) and isinstance(part, int) and part < len(self.value):
            return self.value[part]
        return None

    def at(self, path: Path) -> Node | None:
        """The part of the tree at ``path``; None when the tree is not that deep."""
        node: Node | None = self
        for part in path:
            node = node.child(part) if node is not None else None
        return node

    def mark(self, path: Path, *, key: bool = False) -> Mark:
        """Where the value of ``path`` starts (or its key); where the path leaves the tree, the place
        it left. A bare scalar stands for its first key, so a path may be longer than the tree is deep."""
        return self.place(path, key=key)[1]

    def place(self, path: Path, *, key: bool = False) -> tuple[str, Mark]:
        """As `mark`, with the file."""
        node, spot = self, (self.line, self.column)
        for part in path:
            found = node.child(part)
            if found is None:
                break
            spot = node.keys.get(str(part), spot) if key else (found.line, found.column)
            node = found
        return node.file, spot

    def plain(self) -> object:
        """The tree as str, list and dict."""
        if isinstance(self.value, dict):
            return {key: node.plain() for key, node in self.value.items()}
        if isinstance(self.value, list):
            return [node.plain() for node in self.value]
        return self.value
