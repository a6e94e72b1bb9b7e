"""Preprocessor of mdBook: makes links that leave docs/ lead to the sources.

Pages link to files of the project relative to themselves, as a Git forge reads them. The book lies elsewhere. Each such
link gets the address in `sources` of book.toml before it, or that of this folder. Needs Python 3.8 alone.
"""

import json
import posixpath
import re
import sys
from pathlib import Path

LINK = re.compile(r"\]\((?![a-z][a-z0-9+.-]*:)([^)\s#]+)(#[^)\s]*)?\)")


def rewritten(text: str, page: str, sources: str) -> str:
    """Returns the text of a page (its path in docs/) with absolute links to what lies outside of docs/."""
    folder = posixpath.join("docs", posixpath.dirname(page))

    def absolute(link: re.Match) -> str:
        target = posixpath.normpath(posixpath.join(folder, link[1]))
        if target.startswith("docs/") or target == "docs":
            return link[0]
        return f"]({sources}/{target}{link[2] or ''})"

    return LINK.sub(absolute, text)


def chapters(items: list):
    """Returns all chapters, those below others too."""
    for item in items:
        if isinstance(item, dict) and "Chapter" in item:
            yield item["Chapter"]
            yield from chapters(item["Chapter"]["sub_items"])


def main() -> None:
    if sys.argv[1:2] == ["supports"]:
        return
    context, book = json.load(sys.stdin)
    given = context["config"].get("preprocessor", {}).get("outside", {}).get("sources")
    sources = (given or Path(context["root"]).resolve().parent.as_uri()).rstrip("/")
    # mdBook 0.5 calls the list "items", earlier versions "sections".
    for chapter in chapters(book.get("items") or book.get("sections") or []):
        if chapter.get("path"):
            chapter["content"] = rewritten(chapter["content"], chapter["path"], sources)
    json.dump(book, sys.stdout)


main()
