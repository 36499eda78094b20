"""The server of `jackbench live`: it answers its own page alone, and ends by Ctrl-C."""

import http.client
import json
import signal
import subprocess
import sys
import threading
from contextlib import closing
from functools import partial
from pathlib import Path

import pytest

from workbench.cli import main
from workbench.commands.common.page_server import page_server
from workbench.commands.live.config import load_live
from workbench.commands.live.page import page_files
from workbench.commands.live.session import Session

EXPERIMENTS = Path(__file__).parents[1] / "experiments"
STEP = EXPERIMENTS / "position_step.toml"
ASKED = {"controller": "p-dp", "scenario": "position-10mm", "amplitude": 1, "numbers": {}, "rig": {}}


@pytest.fixture(scope="module")
def server():
    session = Session(load_live(STEP))
    with page_server(page_files(session.start()), session.answers, 0) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        yield server
        server.shutdown()
        thread.join()


def ask(server, method, path, body=None, **headers):
    content = None if body is None else json.dumps(body).encode()
    given = {"Host": server.host, "Content-Length": str(len(content or b"")), **headers}
    with closing(http.client.HTTPConnection("127.0.0.1", server.server_address[1], timeout=30)) as connection:
        connection.putrequest(method, path, skip_host=True)
        for name, value in given.items():
            if value is not None:
                connection.putheader(name, value)
        connection.endheaders(content)
        answer = connection.getresponse()
        return answer.status, answer.read(), answer.headers


def test_the_page_and_its_files_need_the_token(server):
    assert server.server_address[0] == "127.0.0.1"
    status, html, headers = ask(server, "GET", f"/{server.token}/")
    assert status == 200
    assert b"position_step" in html
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    for name in ("live.js", "plots.js", "handles.js", "live.css", "plotly.js"):
        assert ask(server, "GET", f"/{server.token}/{name}")[0] == 200
    for path in ("/", "/live.js", "/wrong/", f"/{server.token[:-1]}/", f"/{server.token}/../live.js"):
        assert ask(server, "GET", path)[0] == 403


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1", "localhost:80", "", None])
def test_another_host_is_not_answered(server, host):
    origin = {"Origin": f"http://{server.host}"}
    assert ask(server, "GET", f"/{server.token}/", Host=host)[0] == 403
    assert ask(server, "POST", f"/{server.token}/view", ASKED, **origin, Host=host)[0] == 403


def test_a_request_needs_token_and_origin(server):
    own = f"http://{server.host}"
    assert ask(server, "POST", "/view", ASKED, Origin=own)[0] == 403
    assert ask(server, "POST", f"/{server.token}/view", ASKED)[0] == 403
    assert ask(server, "POST", f"/{server.token}/view", ASKED, Origin="http://evil.example")[0] == 403
    assert ask(server, "GET", f"/{server.token}/view", Origin=own)[0] == 403
    assert ask(server, "POST", f"/{server.token}/else", ASKED, Origin=own)[0] == 403
    status, content, _ = ask(server, "POST", f"/{server.token}/view", ASKED, Origin=own)
    assert status == 200
    assert json.loads(content)["rows"][0]["rig"] == "nominal"


def test_what_is_no_request_is_refused(server):
    own, path = f"http://{server.host}", f"/{server.token}/view"
    assert ask(server, "POST", path, [1], Origin=own)[0] == 400
    assert ask(server, "POST", path, ASKED, Origin=own, **{"Content-Length": "9999999"})[0] == 400
    assert ask(server, "POST", path, ASKED, Origin=own, **{"Content-Length": "-1"})[0] == 400
    assert ask(server, "POST", path, ASKED, Origin=own, **{"Content-Length": "9" * 5000})[0] == 400
    status, content, _ = ask(server, "POST", path, {**ASKED, "controller": "no"}, Origin=own)
    assert status == 400
    assert "no controller" in json.loads(content)["error"]


@pytest.mark.parametrize("words", [["paper"], ["position_step", "--port", "99999"], ["position_step", "--port", "x"]])
def test_bad_input_is_one_line(capsys, words):
    assert main(["live", *words]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_a_port_that_is_taken_is_named(server, capsys):
    assert main(["live", "position_step", "--port", str(server.server_address[1])]) == 2
    assert "choose another" in capsys.readouterr().err


def test_ctrl_c_ends_it_with_status_0():
    words = [sys.executable, "-m", "workbench.cli", "live", str(STEP)]
    usual = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)  # a background job would ignore it
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(words, **pipes, preexec_fn=usual) as process:
        line = process.stdout.readline()
        assert line.startswith("http://127.0.0.1:")
        process.send_signal(signal.SIGINT)
        assert process.communicate(timeout=30) == ("", "")
        assert process.returncode == 0
