"""The page: what does not change while numbers are moved. Its script asks for the rest."""

import json
from collections.abc import Mapping
from html import escape
from importlib.resources import files
from string import Template
from typing import Any

_KINDS = {"js": "text/javascript; charset=utf-8", "css": "text/css; charset=utf-8", "html": "text/html; charset=utf-8"}
_FILES = {
    "live.js": "commands/live/assets/live.js",
    "plots.js": "commands/live/assets/plots.js",
    "handles.js": "commands/live/assets/handles.js",
    "live.css": "commands/live/assets/live.css",
    "plotly.js": "report/assets/plotly-basic.min.js",
}
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; connect-src 'self'; img-src data: blob:; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)


def page_files(start: Mapping[str, Any]) -> dict[str, tuple[str, bytes]]:
    """Kind and content of what the server gives, by name; the page itself has none. `start`: see Session."""
    package = files("workbench")
    given = {name: (_KINDS[name.rpartition(".")[2]], (package / path).read_bytes()) for name, path in _FILES.items()}
    html = Template((package / "commands/live/assets/page.html").read_text("utf-8"))
    data = json.dumps(start, allow_nan=False).replace("<", "\\u003c")  # no text can end the script element
    title = escape(f"{start['experiment']} on {start['rig']}")
    return {**given, "": (_KINDS["html"], html.substitute(title=title, start=data).encode())}
