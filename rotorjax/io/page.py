"""Markdown reports as one HTML page that opens offline: pictures inside whose curves tell their values to the mouse,
tables that sort by a click on their head, settings folded away.
"""

import base64
import html
import re
from collections.abc import Mapping
from pathlib import Path

from rotorjax.io.atomic import write_text

TEMPLATE = Path(__file__).with_name("page.html")
FOLDED = re.compile(r'(<h2 id="(?:settings|asked-for|time)">.*?</h2>)(.*?)(?=<h2|\Z)', re.DOTALL)  # what few look up
NUMBER = re.compile(r"<td>(?=[-+−]?\d[^<\s]*</td>)")  # a browser would break 1e-04 behind its sign
KINDS = {".png": "image/png", ".svg": "image/svg+xml", ".gif": "image/gif"}


def write_page(path: str | Path, text: str, pictures: Mapping[str, bytes] | None = None) -> None:
    """Write Markdown as a page. Pictures are taken from `pictures`, by name, else from the page's folder; one that is
    not there stays a link.

    The title is the first heading; sections on settings and times are folded; the mouse reads values off the curves of
    pictures that carry them (bench/curves.py). Raises InputError where the file cannot be written.
    """
    from markdown import Markdown

    path = Path(path)
    maker = Markdown(extensions=["tables", "toc", "sane_lists"], extension_configs={"toc": {"toc_depth": "2-2"}})
    given = pictures or {}
    body = re.sub(r'<img ([^>]*?)src="([^"]+)"', lambda m: _embedded(m, path.parent, given), maker.convert(text))
    body = FOLDED.sub(r"<details><summary>\1</summary>\2</details>", body)
    body = NUMBER.sub('<td class="number">', body)
    body = body.replace("<table>", '<div class="wide"><table>').replace("</table>", "</table></div>")
    heading = re.search(r"^# (.+)$", text, re.MULTILINE)
    page = TEMPLATE.read_text(encoding="utf-8")
    title = html.escape(heading[1] if heading else path.stem)
    for name, content in {"title": title, "contents": getattr(maker, "toc", ""), "body": body}.items():
        page = page.replace("{{" + name + "}}", content)
    write_text(path, page)


def _embedded(match: re.Match[str], folder: Path, given: Mapping[str, bytes]) -> str:
    name = html.unescape(match[2])
    picture = folder / name
    if picture.suffix not in KINDS or not (name in given or picture.is_file()):
        return match[0]
    content = base64.b64encode(given[name] if name in given else picture.read_bytes()).decode()
    return f'<img loading="lazy" {match[1]}src="data:{KINDS[picture.suffix]};base64,{content}"'
