"""Mathematics without a network: TeX becomes MathML when the pages are built, and a font for it lies in the site."""

import shutil
from importlib.resources import files
from pathlib import Path

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.errors import SphinxError


def setup(app: Sphinx) -> dict[str, bool]:
    """Give Sphinx the renderer `mathml`."""
    app.connect("build-finished", _font)
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _mathml(node: nodes.Element, display: str) -> str:
    """Raises SphinxError for TeX that has no MathML, with the formula."""
    try:
        return convert(node.astext(), display=display)
    except Exception as error:
        raise SphinxError(f"no MathML of {node.astext()}: {error}") from error


def _inline(translator: nodes.NodeVisitor, node: nodes.Element) -> None:
    translator.body.append(_mathml(node, "inline"))
    raise nodes.SkipNode


def _block(translator: nodes.NodeVisitor, node: nodes.Element) -> None:
    translator.body.append(f'<div class="formula">{_mathml(node, "block")}</div>')
    raise nodes.SkipNode


def _font(app: Sphinx, error: Exception | None) -> None:
    """STIX Two Math (SIL Open Font License): without such a font a browser does not stretch brackets and roots."""
    name = "STIXTwoMath-Regular.ttf"
    shutil.copy(Path(str(files("ziamath") / "fonts" / name)), Path(app.outdir) / "_static" / name)
