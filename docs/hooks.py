"""What the site asks of mkdocs beyond its plugins: notebooks as pages, formulas as MathML, examples as code.

Nothing is fetched by the finished pages. Notebooks are shown with their outputs: those that the tests wrote to
`build/notebooks` if their cells are still the same, else they run here once (some minutes).
"""

import base64
import os
import re
from pathlib import Path

import nbformat
from latex2mathml.converter import convert
from markdown import Extension
from markdown.preprocessors import Preprocessor
from mkdocs.plugins import event_priority
from mkdocs.structure.files import File

ROOT = Path(__file__).parents[1]
NOTEBOOKS = ROOT / "notebooks"
EXECUTED = ROOT / "build" / "notebooks"
FORMULA = re.compile(r'<(span|div) class="arithmatex">\\([(\[])(.*?)\\[)\]]</\1>', re.DOTALL)
ENTITIES = (("&lt;", "<"), ("&gt;", ">"), ("&amp;", "&"))


class _Fenced(Preprocessor):
    """Puts `>>> ` lines and what they print into a fence, as docstrings have them."""

    def run(self, lines):
        out, fence, inside = [], False, False
        for line in lines:
            fence ^= line.lstrip().startswith("```")
            if not fence and not inside and line.startswith(">>> "):
                inside = True
                out += ["", "```pycon"]
            elif inside and not line.strip():
                inside = False
                out += ["```", ""]
            out.append(line)
        return out + ["```"] * inside


class Examples(Extension):
    """Docstrings' examples as code."""

    def extendMarkdown(self, md):
        """Before fences are read."""
        md.preprocessors.register(_Fenced(md), "examples", 40)


def on_config(config):
    """Read examples in docstrings."""
    config.markdown_extensions.append(Examples())
    return config


@event_priority(100)
def on_files(files, config):
    """Add a page and its pictures for each notebook."""
    for path in sorted(NOTEBOOKS.glob("*.ipynb")):
        text, pictures = page_of(executed(path), path.stem)
        files.append(File.generated(config, f"tutorials/{path.stem}.md", content=text))
        for name, content in pictures.items():
            files.append(File.generated(config, f"tutorials/{name}", content=content))
    return files


@event_priority(-100)
def on_page_content(html, **_):
    """Formulas as MathML, which browsers draw themselves."""
    return FORMULA.sub(_mathml, html)


def _mathml(found):
    _, bracket, text = found.groups()
    for entity, sign in ENTITIES:
        text = text.replace(entity, sign)
    return convert(text.strip(), display="block" if bracket == "[" else "inline")


def sources(notebook):
    """The cells as they are written, to tell whether an executed copy is still of them."""
    return [(cell.cell_type, cell.source) for cell in notebook.cells]


def executed(path):
    """The notebook with its outputs; as written where ROTORJAX_DOCS_EXECUTE is 0 and there is no executed copy."""
    written = nbformat.read(path, as_version=4)
    kept = EXECUTED / path.name
    if kept.exists() and sources(found := nbformat.read(kept, as_version=4)) == sources(written):
        return found
    if os.environ.get("ROTORJAX_DOCS_EXECUTE") == "0":
        return written
    from nbclient import NotebookClient

    EXECUTED.mkdir(parents=True, exist_ok=True)
    NotebookClient(written, timeout=900, kernel_name="python3", resources={"metadata": {"path": EXECUTED}}).execute()
    nbformat.write(written, kept)
    return written


def page_of(notebook, name):
    """(Markdown, pictures by file name) of a notebook."""
    parts, pictures = [], {}
    for cell in notebook.cells:
        if cell.cell_type == "markdown":
            parts.append(cell.source)
            continue
        parts.append(f"```python\n{cell.source}\n```")
        parts += [_shown(output, name, pictures) for output in cell.get("outputs", ())]
    where = f"*This page is [notebooks/{name}.ipynb]({name}.ipynb), run from top to bottom.*"
    pictures[f"{name}.ipynb"] = nbformat.writes(_bare(notebook)).encode()
    head, *rest = [part for part in parts if part]
    title, _, after = head.partition("\n")
    return "\n\n".join([title, where, after, *rest]), pictures


def _bare(notebook):
    """Without outputs, to download."""
    bare = nbformat.from_dict(notebook)
    for cell in bare.cells:
        if cell.cell_type == "code":
            cell.outputs, cell.execution_count = [], None
    return bare


def _shown(output, name, pictures):
    """An output as Markdown; a picture is put aside under a name of its own."""
    if output.output_type == "stream":
        return _text(output.text) if output.name == "stdout" else ""
    data = output.get("data", {})
    if "image/png" in data:
        file = f"{name}_{len(pictures)}.png"
        pictures[file] = base64.b64decode(data["image/png"])
        return f"![output]({file})"
    if "text/html" in data:
        return f'<div class="output" markdown="0">\n{_one_block(data["text/html"])}\n</div>'
    return _text(data["text/plain"]) if "text/plain" in data else ""


def _text(text):
    return f"```text\n{text.rstrip()}\n```"


def _one_block(html):
    """HTML without blank lines and styles, so that Markdown takes it as one block."""
    html = re.sub(r"<style.*?</style>", "", html, flags=re.DOTALL)
    return "\n".join(line.strip() for line in html.splitlines() if line.strip())
