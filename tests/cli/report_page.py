"""A report as tests read it."""

from html.parser import HTMLParser

from muslin.cli.report import write_report
from muslin.core.study.study import Study


class Page(HTMLParser):
    """What a page holds: sections, images, addresses, scripts, and its text."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.sections: list[str] = []
        self.figures = {"svg": 0, "img": 0, "canvas": 0, "figure": 0, "details": 0}
        self.addresses: list[str] = []
        self.open: list[str] = []
        self.scripts: list[str] = []
        self.text = ""
        self.feed(html)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        table = dict(attrs)
        if tag == "section":
            self.sections.append(table["id"] or "")
        if tag in self.figures:
            self.figures[tag] += 1
        self.addresses += [v or "" for k, v in attrs if k in ("src", "href", "xlink:href", "srcset", "action")]
        if tag in ("section", "script", "style", "figure", "table", "main", "b", "i", "dl", "details"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if self.open and tag in ("section", "script", "style", "figure", "table", "main", "b", "i", "dl", "details"):
            assert self.open.pop() == tag, f"</{tag}> closes something else"

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] == "script":
            self.scripts.append(data)
        elif not self.open or self.open[-1] != "style":
            self.text += data


def page_of(study: Study, after: Study | None = None) -> Page:
    page = Page(write_report(study, after=after).read_text(encoding="utf-8"))
    page.text = " ".join(page.text.replace("\u00a0", " ").replace("\u202f", " ").split())
    return page
