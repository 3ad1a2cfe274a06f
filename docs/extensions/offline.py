"""The built pages make no request: whatever a browser would load comes from the site itself."""

import re
from html.parser import HTMLParser
from pathlib import Path

from sphinx.application import Sphinx
from sphinx.errors import ExtensionError

REMOTE = re.compile(r"^\s*(https?:)?//")
# attributes whose address a browser fetches without being asked; a link in <a> waits for a click
FETCHED = {
    "link": ("href",),
    "script": ("src",),
    "img": ("src", "srcset"),
    "source": ("src", "srcset"),
    "iframe": ("src",),
    "video": ("src", "poster"),
    "audio": ("src",),
    "object": ("data",),
    "embed": ("src",),
}
STYLE_ADDRESS = re.compile(r"""(?:url\(\s*['"]?|@import\s+['"])\s*((?:https?:)?//[^'")\s]+)""")


class _Addresses(HTMLParser):
    """Collects the remote addresses that a page would fetch."""

    def __init__(self) -> None:
        super().__init__()
        self.remote: list[str] = []

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        """Look at one tag; "canonical" and the like are statements, not requests."""
        given = dict(attributes)
        if tag == "link" and given.get("rel") in ("canonical", "next", "prev", "author"):
            return
        for name in FETCHED.get(tag, ()):
            value = given.get(name) or ""
            if REMOTE.match(value):
                self.remote.append(value)


def remote_addresses(site: Path) -> list[str]:
    """Each page or style sheet of a built site with the remote address that it would fetch."""
    findings = []
    for page in sorted(site.rglob("*.html")):
        reader = _Addresses()
        reader.feed(page.read_text("utf-8"))
        findings += [f"{page.relative_to(site)}: {address}" for address in reader.remote]

    for sheet in sorted(site.rglob("*.css")):
        addresses = STYLE_ADDRESS.findall(sheet.read_text("utf-8"))
        findings += [f"{sheet.relative_to(site)}: {address}" for address in addresses]
    return findings


def _check(app: Sphinx, failure: Exception | None) -> None:
    if failure is not None or app.builder.format != "html":
        return
    if findings := remote_addresses(Path(app.outdir)):
        raise ExtensionError(
            "these built pages would fetch something from elsewhere; ship it with the site: "
            + "; ".join(findings[:10])
        )


def setup(app: Sphinx) -> dict[str, bool]:
    """Check the site when it is built."""
    app.connect("build-finished", _check)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
