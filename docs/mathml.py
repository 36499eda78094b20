"""Mathematics without a network: TeX becomes MathML when the pages are built, which every browser shows by itself."""

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.errors import SphinxError


def setup(app: Sphinx) -> dict[str, bool]:
    """Give Sphinx the renderer `mathml`."""
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
