"""A page of headings, text, tables and pictures, written as HTML by the template data/page.html.

Text may hold `names as they are typed`, **what matters** and links [text](#anchor).
"""
import html
import re
import urllib.parse
from collections import namedtuple
from pathlib import Path

import jinja2

# Kinds of a cell are how it looks: paper, holds, not, open, sure; of a row: paper, more (what the paper has not), rule (a line above
# it).
Cell = namedtuple("Cell", "text kind")
Row = namedtuple("Row", "cells kinds", defaults=("",))
DATA = Path(__file__).resolve().parent / "data"


def to_html(text):
    """Inline markup as HTML; what stands between backticks is taken as it is."""
    parts = re.split(r"`([^`]*)`", html.escape(text, quote=False))
    for i, part in enumerate(parts):
        if i % 2:
            parts[i] = f"<code>{part}</code>"
        else:
            part = re.sub(r"\*\*(.+?)\*\*", r"<strong>\1</strong>", part)
            parts[i] = re.sub(r"\[([^\]]+)\]\((#[\w-]+)\)", r'<a href="\2">\1</a>', part)
    return "".join(parts)


class Document:
    def __init__(self, title):
        self.title, self.contents, self.blocks = title, [], []
        self.pictures = {}  # {name: SVG}

    def lay_out(self, blocks):
        """Each block of a file data/*.yaml is the name of a method without its "add_", alone or with what it is given."""
        for block in blocks:
            kind, *given = [block] if isinstance(block, str) else next(iter(block.items()))
            getattr(self, f"add_{kind}")(*given)

    def add_heading(self, level, text, anchor=""):
        if anchor:
            self.contents.append(f"[{text}](#{anchor})")
        self.blocks.append(("heading", {"level": level, "text": text, "anchor": anchor}))

    def add_section(self, anchor_and_title):
        self.add_heading(2, *reversed(anchor_and_title))

    def add_part(self, anchor_and_title):
        self.add_heading(3, *reversed(anchor_and_title))

    def add_text(self, text):
        self.blocks.append(("text", {"text": text}))

    def add_bullets(self, items):
        self.blocks.append(("bullets", {"listed": items}))

    def add_figure(self, name, svg, caption):
        """`name` is its anchor."""
        self.pictures[name] = svg
        image = "data:image/svg+xml," + urllib.parse.quote(" ".join(svg.split()), safe=" /:;,=.()'-")
        alternative = re.sub(r"[*`]", "", " ".join(caption.split()).split(". ")[0])
        self.blocks.append(("figure", {"name": name, "image": image, "alternative": alternative, "caption": caption}))

    def add_rows(self, caption, headings, rows, texts=(0,)):
        """A table; `texts` are the columns that hold text. Cells are texts or Cells, rows are lists of them or Rows."""
        self.blocks.append(("table", {"caption": caption, "headings": headings, "rows": rows, "texts": texts}))

    def html(self):
        environment = jinja2.Environment(loader=jinja2.FileSystemLoader(str(DATA)), trim_blocks=True, keep_trailing_newline=True)
        environment.filters.update(markup=to_html, words=lambda text: " ".join(text.split()))
        return environment.get_template("page.html").render(page=self, style=(DATA / "page.css").read_text(encoding="utf-8"))
