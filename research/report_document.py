"""A page of headings, text, tables and pictures, written as HTML.

Text may hold `names as they are typed`, **what matters** and links [text](#anchor).
"""
import html
import re
import urllib.parse
from collections import namedtuple
from pathlib import Path

Drawing = namedtuple("Drawing", "svg pdf")  # bytes, and what makes them
# Kinds of a cell are how it looks: paper, holds, not, open, sure; of a row: paper, more (what the paper has not), rule (a line above
# it).
Cell = namedtuple("Cell", "text kind")
Row = namedtuple("Row", "cells kinds", defaults=("",))
STYLE = (Path(__file__).resolve().parent / "data" / "page.css").read_text(encoding="utf-8")
LONG = 32  # rows: such a table does not fit on a page, and may be continued on the next


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
        self.pictures = {}  # by name, those that were drawn

    def lay_out(self, blocks):
        """Each block of a file data/*.yaml is the name of a method without its "add_", alone or with what it is given."""
        for block in blocks:
            kind, *given = [block] if isinstance(block, str) else next(iter(block.items()))
            getattr(self, f"add_{kind}")(*given)

    def add_heading(self, level, text, anchor=""):
        if anchor:
            self.contents.append(f"[{text}](#{anchor})")
        identity = f' id="{anchor}"' if anchor else ""
        self.blocks.append(f"<h{level}{identity}>{to_html(text)}</h{level}>")

    def add_section(self, anchor_and_title):
        self.add_heading(2, *reversed(anchor_and_title))

    def add_part(self, anchor_and_title):
        self.add_heading(3, *reversed(anchor_and_title))

    def add_text(self, text):
        self.blocks.append(f'<p>{to_html(" ".join(text.split()))}</p>')

    def add_bullets(self, items):
        self.blocks.append(bullets(items))

    def add_figure(self, name, image, caption):
        """`image`: a Drawing, or the path of a file; `name` is its anchor."""
        caption = " ".join(caption.split())
        if isinstance(image, Drawing):
            self.pictures[name] = image
            text = " ".join(image.svg.decode("utf-8").split())
            image = "data:image/svg+xml," + urllib.parse.quote(text, safe=" /:;,=.()'-")
        alternative = html.escape(re.sub(r"[*`]", "", caption.split(". ")[0]), quote=True)
        self.blocks.append(f'<figure id="{name}"><img alt="{alternative}" src="{image}"/>\n'
                           f"<figcaption>{to_html(caption)}</figcaption></figure>")

    def add_rows(self, caption, headings, rows, texts=(0,)):
        """A table; `texts` are the columns that hold text. Cells are texts or Cells, rows are lists of them or Rows."""
        def cell(tag, column, text, kind=""):
            kinds = [kind] * bool(kind) + ["text"] * (column in texts) + ["first"] * (column == 0)
            return f"<{tag}{classes(kinds)}>{to_html(text)}</{tag}>"

        lines = [f'<div class="{"table long" if len(rows) > LONG else "table"}"><table>',
                 f"<caption>{to_html(caption)}</caption>", "<thead>",
                 "<tr>" + "".join(cell("th", i, heading) for i, heading in enumerate(headings)) + "</tr>", "</thead>\n<tbody>"]
        for row in rows:
            cells, kinds = row if isinstance(row, Row) else Row(row)
            lines.append(f"<tr{classes([kinds] * bool(kinds))}>" + "".join(
                cell("td", i, *(each if isinstance(each, Cell) else [each])) for i, each in enumerate(cells)) + "</tr>")
        self.blocks.append("\n".join([*lines, "</tbody></table></div>"]))

    def html(self):
        title, body = html.escape(self.title, quote=False), "\n".join(self.blocks)
        return (f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8"/>\n'
                f'<meta name="viewport" content="width=device-width, initial-scale=1"/>\n<title>{title}</title>\n'
                f"<style>\n{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n{bullets(self.contents)}\n{body}\n"
                f"</body>\n</html>\n")


def bullets(items):
    return "<ul>\n" + "\n".join(f'<li>{to_html(" ".join(item.split()))}</li>' for item in items) + "\n</ul>"


def classes(kinds):
    return f' class="{" ".join(kinds)}"' if kinds else ""
