"""The page: what does not change while numbers are moved. Its script asks for the rest."""

import json
from collections.abc import Mapping
from html import escape
from importlib.resources import files
from string import Template
from typing import Any

from ..common.page_server import KINDS

_FILES = {
    "live.js": "commands/live/assets/live.js",
    "plots.js": "commands/live/assets/plots.js",
    "handles.js": "commands/live/assets/handles.js",
    "live.css": "commands/live/assets/live.css",
    "plotly.js": "report/assets/plotly-basic.min.js",
}


def page_files(start: Mapping[str, Any]) -> dict[str, tuple[str, bytes]]:
    """Kind and content of what the server gives, by name; the page itself has none. `start`: see Session."""
    package = files("workbench")
    given = {name: (KINDS[name.rpartition(".")[2]], (package / path).read_bytes()) for name, path in _FILES.items()}
    html = Template((package / "commands/live/assets/page.html").read_text("utf-8"))
    data = json.dumps(start, allow_nan=False).replace("<", "\\u003c")  # no text can end the script element
    title = escape(f"{start['experiment']} on {start['rig']}")
    return {**given, "": (KINDS["html"], html.substitute(title=title, start=data).encode())}
