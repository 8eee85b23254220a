"""Edits of a text, collected by position and applied at once; comments stay with the lines below them."""

import re

from greensward.scene.toml_text import Node, Place, Section

_INLINE, _LINE, _BLOCK, _REPLACED = range(4)
_GAP = re.compile(r"  +(?=#)")


class Edits:
    """Edits of one text; places are those of the text as it was."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._replaced: list[tuple[Place, str]] = []
        self._added: list[tuple[int, int, str]] = []

    @property
    def end(self) -> int:
        """End of the text."""
        return len(self._text)

    def there(self, place: Place) -> str:
        """Return the text at a place."""
        return self._text[slice(*place)]

    def replace(self, place: Place, text: str) -> None:
        """Replace the text at a place; a larger replacement wins over those inside it."""
        self._replaced.append((place, text))

    def change(self, place: Place, text: str) -> None:
        """Replace a value; a comment behind it, set off by two spaces or more, stays in its column."""
        start, end = place
        if gap := _GAP.match(self._text, end):
            end, text = gap.end(), text.ljust(gap.end() - start - 1) + " "
        self.replace((start, end), text)

    def add(self, at: int, text: str) -> None:
        """Insert text within a line."""
        self._added.append((at, _INLINE, text))

    def add_line(self, at: int, line: str) -> None:
        """Insert a line where a line starts."""
        self._added.append((at, _LINE, line))

    def add_block(self, at: int, block: str) -> None:
        """Insert lines where a line starts, set off by blank lines, below all single lines that are added there."""
        self._added.append((at, _BLOCK, block))

    def remove(self, node: Node) -> None:
        """Remove all lines of a key: those that set it, its headers, and the comments right above these."""
        for part in node.inside():
            if part.lines:
                self.replace(part.lines, "")
            if part.section:
                before = len(self._text[: self.above(part.section)].rstrip())
                end = part.section.end
                while not before and self._text[end : end + 1] == "\n":
                    end += 1
                self.replace((before + 1 if before else 0, end), "")

    def above(self, section: Section) -> int:
        """Start of a section with the comments right above it; those that open the file do not count."""
        start = section.start
        while start > 0:
            before = self._text.rfind("\n", 0, start - 1) + 1
            if not self._is_comment(before):
                return start
            start = before
        return section.start

    def below(self, end: int) -> int:
        """End of lines with the comments right below them, unless these belong to the next header."""
        after = end
        while after < self.end and self._is_comment(after):
            after = (self._text.find("\n", after) + 1) or self.end
        return end if self._text[after:].lstrip(" \t").startswith("[") else after

    def _is_comment(self, line: int) -> bool:
        return self._text[line : self._text.find("\n", line) + 1 or None].lstrip(" \t").startswith("#")

    def applied(self) -> str:
        """The text with all changes made."""
        replaced = self._apart()
        steps = [(start, _REPLACED, end, text) for (start, end), text in replaced]
        for at, rank, text in self._added:
            outside = next((end for (start, end), _ in replaced if start < at < end), at)
            steps.append((outside, rank, outside, text))
        made, at, after_block = "", 0, False
        for start, rank, end, text in [
            *sorted(steps, key=lambda step: step[:2]),
            (self.end, _REPLACED, self.end, ""),
        ]:
            kept = self._text[at:start]
            made += "\n" + kept if after_block and kept[:1] not in ("", "\n") else kept
            after_block = after_block and not kept
            if rank in (_LINE, _BLOCK) and made:
                made += "\n" * (not made.endswith("\n"))
            if rank == _BLOCK:
                made += "\n" * (bool(made) and not made.endswith("\n\n"))
                after_block = True
            made, at = made + text, end
        return made

    def _apart(self) -> list[tuple[Place, str]]:
        """Replacements in order, without those inside a larger place."""
        apart: list[tuple[Place, str]] = []
        for (start, end), text in sorted(self._replaced, key=lambda change: (change[0][0], -change[0][1])):
            if apart and start < apart[-1][0][1]:
                (first, last), before = apart[-1]
                apart[-1] = (first, max(last, end)), before
            else:
                apart.append(((start, end), text))
        return apart
