"""Checks that a report is one self-contained page: `check_page.py report.html`."""

import re
import sys
from html.parser import HTMLParser
from pathlib import Path

LOADS = ("src", "href", "srcset", "poster", "data", "action", "formaction", "background")


class Page(HTMLParser):
    def __init__(self):
        super().__init__()
        self.problems, self.generator, self.style = [], None, []
        self.within = None

    def handle_starttag(self, tag, attributes):
        self.within = tag
        values = dict(attributes)
        if tag == "meta" and values.get("name") == "generator":
            self.generator = values.get("content")
        for name in LOADS:
            value = values.get(name)
            if value is not None and not value.startswith(("data:", "#")):
                self.problems.append(f"<{tag} {name}={value[:60]!r}> loads something")

    def handle_endtag(self, tag):
        self.within = None

    def handle_data(self, text):
        if self.within == "style":
            self.style.append(text)


path = Path(sys.argv[1])
if not path.is_file():
    sys.exit(f"{path} was not written")
text = path.read_text(encoding="utf-8")
page = Page()
page.feed(text)
problems = page.problems
for found in re.findall(r"@import|url\((?!\s*['\"]?data:)[^)]*\)", " ".join(page.style)):
    problems.append(f"the style loads something: {found}")
if page.generator != "ctid":
    problems.append(f"the generator is {page.generator!r} instead of 'ctid'")
if not text.rstrip().endswith("</html>"):
    problems.append("the page is cut off")
if problems:
    sys.exit("\n".join([f"{path}:"] + problems))
print(f"{path.name}: {len(text.encode()) / 1e6:.1f} MB, self-contained")
