"""A document of headings, text, tables and pictures, written as one HTML page; its tables as LaTeX, too.

Text may hold `names as they are typed`, **what matters** and links [text](#anchor).
"""
import html
import re
import urllib.parse
from collections import namedtuple
from pathlib import Path

Drawing = namedtuple("Drawing", "svg pdf")  # bytes, and what makes them
STYLE = (Path(__file__).resolve().parent / "data" / "page.css").read_text(encoding="utf-8")
LONG = 32  # rows: such a table does not fit on a page, and may be continued on the next


def to_html(text):
    """Inline markup as HTML; what stands between backticks is taken as it is."""
    parts = re.split(r"`([^`]*)`", text)
    for i, part in enumerate(parts):
        part = html.escape(part, quote=False)
        if i % 2:
            parts[i] = f"<code>{part}</code>"
            continue
        part = re.sub(r"\*\*(.+?)\*\*", r"<strong>\1</strong>", part)
        parts[i] = re.sub(r"\[([^\]]+)\]\((#[\w-]+)\)", r'<a href="\2">\1</a>', part)
    return "".join(parts)


def to_latex(text):
    """Inline markup as LaTeX."""
    for character, command in (("\\", r"\textbackslash "), *((each, "\\" + each) for each in "&%$#_{}"), ("~", r"\textasciitilde "),
                               ("^", r"\textasciicircum "), ("±", r"$\pm$"), ("−", "$-$"), ("σ", r"$\sigma$"), ("µ", r"$\mu$"),
                               ("\u00a0", "~")):
        text = text.replace(character, command)
    text = re.sub(r"`([^`]*)`", r"\\texttt{\1}", text)
    return re.sub(r"\*\*(.+?)\*\*", r"\\textbf{\1}", text)


class Heading(namedtuple("Heading", "level text anchor", defaults=("",))):
    def html(self):
        anchor = f' id="{self.anchor}"' if self.anchor else ""
        return f"<h{self.level}{anchor}>{to_html(self.text)}</h{self.level}>"

    def latex(self):
        return f"% {self.text}\n"


class Text:
    def __init__(self, text):
        self.text = " ".join(text.split())

    def html(self):
        return f"<p>{to_html(self.text)}</p>"


class Bullets:
    def __init__(self, items):
        self.items = [" ".join(item.split()) for item in items]

    def html(self):
        return "<ul>\n" + "\n".join(f"<li>{to_html(item)}</li>" for item in self.items) + "\n</ul>"


# Kinds of a cell are how it looks: paper, holds, not, open, sure; of a row: paper, more (what the paper has not), rule (a line above
# it).
Cell = namedtuple("Cell", "text kind", defaults=("",))
Row = namedtuple("Row", "cells kinds", defaults=("",))


class Table:
    """`texts` are the columns that hold text."""

    def __init__(self, caption, headings, rows, texts=(0,)):
        self.caption, self.headings, self.texts, self.rows = caption, headings, texts, []
        for row in rows:
            cells, kinds = row if isinstance(row, Row) else Row(row)
            if len(cells) != len(headings):
                raise ValueError(f"{caption}: a row of {len(cells)} cells under {len(headings)} headings")
            self.rows.append(Row([cell if isinstance(cell, Cell) else Cell(cell) for cell in cells], kinds))

    def html(self):
        def attribute(column, *kinds):
            kinds = [*kinds, *(["text"] if column in self.texts else []), *(["first"] if column == 0 else [])]
            kinds = " ".join(kind for kind in kinds if kind)
            return f' class="{kinds}"' if kinds else ""

        lines = [f'<div class="{"table long" if len(self.rows) > LONG else "table"}"><table>',
                 f"<caption>{to_html(self.caption)}</caption>", "<thead>"]
        lines.append("<tr>" + "".join(
            f"<th{attribute(i)}>{to_html(heading)}</th>" for i, heading in enumerate(self.headings)) + "</tr>")
        lines.append("</thead>\n<tbody>")
        for row in self.rows:
            kinds = f' class="{row.kinds}"' if row.kinds else ""
            lines.append(f"<tr{kinds}>" + "".join(
                f"<td{attribute(i, cell.kind)}>{to_html(cell.text)}</td>" for i, cell in enumerate(row.cells)) + "</tr>")
        return "\n".join([*lines, "</tbody></table></div>"])

    def latex(self):
        def line(texts):
            return " & ".join(to_latex(text) for text in texts) + r" \\"

        columns = "".join("l" if i in self.texts else "r" for i in range(len(self.headings)))
        return "\n".join([r"\begin{table}", rf"\caption{{{to_latex(self.caption)}}}", rf"\begin{{tabular}}{{{columns}}}", r"\toprule",
                          line(self.headings), r"\midrule", *(line([cell.text for cell in row.cells]) for row in self.rows),
                          r"\bottomrule", r"\end{tabular}", r"\end{table}", ""])


class Picture:
    """A picture, a Drawing or by the path of its file; `name` is its anchor."""

    def __init__(self, name, image, caption):
        self.name, self.image, self.caption = name, image, " ".join(caption.split())

    def alternative(self):
        return html.escape(re.sub(r"[*`]", "", self.caption.split(". ")[0]), quote=True)

    def html(self):
        source = self.image
        if isinstance(source, Drawing):
            text = " ".join(source.svg.decode("utf-8").split())
            source = "data:image/svg+xml," + urllib.parse.quote(text, safe=" /:;,=.()'-")
        return (f'<figure id="{self.name}"><img alt="{self.alternative()}" src="{source}"/>\n'
                f"<figcaption>{to_html(self.caption)}</figcaption></figure>")


class Document:
    def __init__(self, title):
        self.title, self.blocks = title, []

    def add(self, *blocks):
        self.blocks += [block for block in blocks if block is not None]

    def contents(self):
        return Bullets([f"[{block.text}](#{block.anchor})" for block in self.blocks
                        if isinstance(block, Heading) and block.anchor])

    def pictures(self):
        return [block for block in self.blocks if isinstance(block, Picture)]

    def latex(self):
        """All tables, below the headings as comments; they need the package booktabs."""
        return "\n".join(block.latex() for block in self.blocks if isinstance(block, (Heading, Table)))

    def html(self):
        body = "\n".join(block.html() for block in self.blocks)
        title = html.escape(self.title, quote=False)
        return (f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8"/>\n'
                f'<meta name="viewport" content="width=device-width, initial-scale=1"/>\n<title>{title}</title>\n'
                f"<style>\n{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n{self.contents().html()}\n{body}\n"
                f"</body>\n</html>\n")
