"""Sphinx: pages are Markdown; what the code knows is written by `generate` into reference/ before they are read."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))  # the modules beside this file
sys.path[1:1] = [str(Path(__file__).parents[1] / ".ci"), str(Path(__file__).parents[1])]  # the browser; the studies

(Path(__file__).parent / "_build" / "gallery" / "site").mkdir(parents=True, exist_ok=True)

project = "jackbench"
author = "the jackbench authors"
copyright = "the jackbench authors, BSD 3-clause"
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "generate",
    "generate.cells",
    "generate.tables",
    "mathml",
    "docstrings",
]
exclude_patterns = ["_build", "files", "reference/part_*"]
myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 3
suppress_warnings = ["myst.header"]  # a part of CONTRIBUTING.md begins at the level that it has there

autodoc_typehints = "none"
autodoc_member_order = "bysource"
toc_object_entries = False

html_theme = "furo"
html_title = "jackbench"
html_math_renderer = "mathml"
html_static_path = ["_static"]
html_extra_path = ["_build/gallery/site"]  # reports, as their commands left them
html_css_files = ["site.css"]
html_show_sphinx = False
html_copy_source = False
html_show_sourcelink = False
