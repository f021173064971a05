"""A profile that starts from another one: ``like: parent``.

Tables merge by name after bare scalars are written out, lists and scalars are replaced, and ``null``
removes. Every part of the result knows the file that it stands in.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from gateway.mapping import model
from gateway.mapping.finding import Finding
from gateway.mapping.library import Library, unreadable
from gateway.mapping.node import Node, Path
from gateway.mapping.reader import LIKE, read
from gateway.mapping.shape import Entry, nearest

_OWN = ("profile", LIKE)
"""Keys that are never inherited."""
_ENTRIES: dict[str, type[Entry]] = {
    "points": model.Register,
    "bits": model.BitField,
    "errors": model.ErrorCode,
    "documents": model.Document,
    "serial": model.Fact,
    "modbus": model.Fact,
}
"""Tables whose entries may be bare scalars."""


def with_parents(root: Node, library: Library) -> tuple[Node | None, list[Finding]]:
    """The tree with those of its ancestors below it, and what is wrong with the descent.

    Findings about the form of an ancestor's text are included. Without a parent the tree stays as it is;
    None when one of the ancestors cannot be had.
    """
    descent = _Descent(library)
    return descent.whole(root), descent.findings


class _Descent:
    """Gathers the ancestors of one file and merges them, the eldest first."""

    def __init__(self, library: Library) -> None:
        self._library = library
        self._merge = _Merge()
        self.findings: list[Finding] = self._merge.findings

    def whole(self, root: Node) -> Node | None:
        generations = [root]
        names = [_text(root, "profile")]
        while (like := generations[-1].child(LIKE)) is not None:
            if not isinstance(like.value, str):
                self._complain(like, "one name is expected here", "write the name of a profile")
                return None
            parent = self._parent(like, names)
            if parent is None:
                return None
            names.append(like.value)
            generations.append(parent)
        tree = generations.pop()
        while generations:
            tree = self._merge.laid_over(_without_own(tree), generations.pop(), ())
        return tree

    def _parent(self, like: Node, names: list[str]) -> Node | None:
        """The tree of the profile that ``like`` names."""
        name = str(like.value)
        path = self._library.find(name)
        if name in names:
            chain = " is like ".join(f"`{each}`" for each in [*names[names.index(name) :], name])
            self._complain(like, f"the descent goes in a circle: {chain}", "break it")
        elif path is None:
            match = nearest(name, self._library.names())
            remedy = match if match.startswith("did") else "put it beside this file"
            self._complain(like, f"there is no profile `{name}`", remedy)
        else:
            try:
                file = self._library.take(path)
            except OSError as error:
                self.findings.append(unreadable(path, error))
                return None
            root, findings = read(file.data, file.name)
            self.findings += findings
            if root is not None and isinstance(root.value, dict):
                return root
            self._complain(like, f"the profile `{name}` is no table", "correct that file")
        return None

    def _complain(self, node: Node, message: str, remedy: str) -> None:
        self.findings.append(Finding("error", node.file, node.line, node.column, message, remedy))


class _Merge:
    """Lays trees over each other; ``findings`` tells what could not be removed."""

    def __init__(self) -> None:
        self.findings: list[Finding] = []

    def laid_over(self, below: Node, above: Node, path: Path) -> Node:
        """``below`` with everything that ``above`` says replaced, added or removed."""
        first = _first_key(path)
        if first is not None and _differ(below, above):
            below, above = _written_out(below, first), _written_out(above, first)
        if not isinstance(below.value, dict) or not isinstance(above.value, dict):
            return above
        values, keys = dict(below.value), {**below.keys, **above.keys}
        for key, node in above.value.items():
            known = values.get(key)
            values[key] = node if known is None else self.laid_over(known, node, (*path, key))
        for key in above.keys.keys() - above.value.keys():
            self._remove(key, values, above)
            keys.pop(key)
        return replace(above, value=values, keys=keys)

    def _remove(self, key: str, values: dict[str, Node], above: Node) -> None:
        if values.pop(key, None) is None:
            message = f"there is no `{key}` to remove"
            remedy = nearest(key, list(values))
            self.findings.append(Finding("error", above.file, *above.keys[key], message, remedy))


def _differ(one: Node, other: Node) -> bool:
    """True when one is a table and the other is not."""
    return isinstance(one.value, dict) != isinstance(other.value, dict)


def _written_out(node: Node, first: str) -> Node:
    """A bare scalar (or list) as the table that it stands for."""
    if isinstance(node.value, dict):
        return node
    return replace(node, value={first: node}, keys={first: (node.line, node.column)})


def _first_key(path: Path) -> str | None:
    """The key that a bare scalar at ``path`` stands for; None where none may stand."""
    named = path[-2:-1] == ("values",) if path[:1] != ("values",) else len(path) == 3
    if named:
        return model.NamedValue.first
    holder = path[-2] if len(path) > 1 else None
    return _ENTRIES[holder].first if isinstance(holder, str) and holder in _ENTRIES else None


def _without_own(tree: Node) -> Node:
    """A parent's tree without what only it can say of itself."""
    return replace(tree, value=dict(_inherited(tree)))


def _inherited(tree: Node) -> Iterator[tuple[str, Node]]:
    assert isinstance(tree.value, dict)
    yield from ((key, node) for key, node in tree.value.items() if key not in _OWN)


def _text(root: Node, key: str) -> str:
    node = root.child(key)
    return node.value if node is not None and isinstance(node.value, str) else ""
