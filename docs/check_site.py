"""Check the built site: links lead somewhere, no page needs another host, the size, and in a browser accessibility.

``python docs/check_site.py docs/_build/html`` reads the files; with ``--browser`` it also opens pages from disk.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

MAX_MB = 60.0
LOADING = {"script": "src", "img": "src", "link": "href", "iframe": "src", "source": "src", "object": "data"}
"""Tag -> the attribute by which a browser loads something."""
PASSIVE_LINKS = {"canonical", "next", "prev", "index", "search", "author"}
"""Relations of a link element that load nothing."""


class Page(HTMLParser):
    """Links, loaded files and anchors of one page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.loads: list[str] = []
        self.anchors: set[str] = {""}
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Collect what a tag refers to."""
        values = {name: value or "" for name, value in attrs}
        self.anchors |= {values[name] for name in ("id", "name") if name in values}
        if tag == "a" and "href" in values:
            self.links.append(values["href"])
        if (name := LOADING.get(tag)) in values and values.get("rel", "") not in PASSIVE_LINKS:
            self.loads.append(values[name])


def page_paths(site: Path) -> list[Path]:
    """All pages, without the templates of the theme."""
    return sorted(path for path in site.rglob("*.html") if "_static" not in path.parts)


def check_files(site: Path) -> list[str]:
    """Return what is wrong with the files."""
    pages = {
        path: Page(path.read_text(encoding="utf-8")) for path in site.rglob("*.html") if "_static" not in path.parts
    }
    wrong = []
    for path, page in pages.items():
        name = path.relative_to(site)
        wrong += [f"{name}: loads {url}" for url in page.loads if urlsplit(url).netloc]
        for url in page.links + page.loads:
            parts = urlsplit(url)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if not target.exists():
                wrong.append(f"{name}: {url} leads nowhere")
            elif target in pages and unquote(parts.fragment) not in pages[target].anchors:
                wrong.append(f"{name}: {url} has no such anchor")
    megabytes = sum(path.stat().st_size for path in site.rglob("*") if path.is_file()) / 1e6
    print(f"site: {len(pages)} pages, {megabytes:.1f} MB")
    if megabytes > MAX_MB:
        wrong.append(f"the site has {megabytes:.0f} MB; the limit is {MAX_MB:.0f} MB")
    return sorted(set(wrong))


def check_in_browser(site: Path) -> list[str]:
    """Open pages from disk: no request to a host, no script error, nothing serious for axe, and a search that finds."""
    from axe_playwright_python.sync_playwright import Axe
    from playwright.sync_api import sync_playwright

    wrong: list[str] = []
    api = [path for path in page_paths(site) if "names" in path.parts]
    shown = [path for path in page_paths(site) if path not in api] + api[:6]
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1300, "height": 900})
        page.on(
            "request", lambda one: None if one.url.startswith(("file:", "data:")) else wrong.append(f"asks {one.url}")
        )
        page.on("pageerror", lambda error: wrong.append(f"{page.url}: {error}"))
        for path in shown:
            page.goto(path.as_uri())
            for one in Axe().run(page).response["violations"]:
                if one["impact"] in ("serious", "critical"):
                    place = one["nodes"][0]["html"][:150]
                    wrong.append(f"{path.relative_to(site)}: {one['id']} ({one['impact']}): {place}")
        page.goto(f"{(site / 'search.html').as_uri()}?q=stiction")
        page.wait_for_selector("#search-results li", timeout=10_000)
        print(f"browser: {len(shown)} pages, {page.locator('#search-results li').count()} results of a search")
        browser.close()
    return sorted(set(wrong))


def main() -> int:
    """Check a site and print what is wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("site", type=Path)
    parser.add_argument("--browser", action="store_true")
    given = parser.parse_args()
    wrong = check_files(given.site.resolve())
    if given.browser:
        wrong += check_in_browser(given.site.resolve())
    print("\n".join(wrong) if wrong else "site: nothing wrong")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
