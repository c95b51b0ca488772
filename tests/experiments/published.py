"""Puts published tables into the documents that show them.

    python tests/experiments/published.py

A document names a table, and which of its rows, in a comment:

    <!-- table results/test/tables/side-by-side.csv: scene-graph; plan-check, wrong -->
    <!-- end of table -->

What is between the two is written here and by nobody else; a test holds it against the table.
"""

from __future__ import annotations

import csv
import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCUMENTS = (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")))
SHOWN = re.compile(r"(<!-- table (\S+?)(?:: (.*?))? -->\n).*?(<!-- end of table -->)", re.DOTALL)


def filled(text: str) -> str:
    """A document with the tables that it names."""
    return SHOWN.sub(lambda m: m[1] + table(ROOT / m[2], m[3]) + m[4], text)


def table(path: Path, chosen: str | None) -> str:
    """Some rows of a CSV file as Markdown.

    Args:
        path: of the file.
        chosen: first cells of the rows, separated by semicolons; all by default.
    """
    with path.open(encoding="utf-8", newline="") as file:
        head, *rows = csv.reader(file)
    wanted = None if chosen is None else [n.strip() for n in chosen.split(";")]
    if wanted is not None:
        there = {row[0] for row in rows}
        assert there.issuperset(wanted), f"{path} has no {sorted(set(wanted) - there)}"
        rows = [row for name in wanted for row in rows if row[0] == name]
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(c.replace('|', '/') for c in line)} |\n" for line in lines)


def main() -> None:
    """Write every document anew that shows a table."""
    for document in DOCUMENTS:
        text = document.read_text(encoding="utf-8")
        if (new := filled(text)) != text:
            document.write_text(new, encoding="utf-8")


if __name__ == "__main__":
    main()
