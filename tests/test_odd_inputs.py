"""Files and names that are odd: every one ends in one line, at once, and with little memory."""

import errno
import gzip
import io
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from workbench.base import units
from workbench.base.errors import InputError, echo
from workbench.base.files import read_bytes
from workbench.cli import main
from workbench.commands.common import run_folder
from workbench.records.frequency_sheet import read_response
from workbench.records.read import read_record

ROOT = Path(__file__).parents[1]
SAMPLE = ROOT / "experiments" / "sample"
RIG = (ROOT / "workbench" / "rigs" / "jack-10t.toml").read_text("utf-8")
STROKE = 'value = 0.5, unit = "m"'
STEP = """experiment = "step"
rig = "jack-10t"
scenarios = ["position-1mm"]
[bode]
low_hz = 0.5
high_hz = 30
points = 12
amplitudes_mm = [1]
[controllers.p]
use = "controllers.p:P"
gain = "3.7 1/m"
"""
MINE = STEP.replace('"position-1mm"', '"mine"') + "[scenario.mine]\n"
EXCITE = ("excite", "jack-10t", "chirp", "--amplitude", "0.1", "--seconds", "1", "--out", "x.csv")
SECONDS = 3  # a machine that does other things besides takes longer than the second that is wanted


@pytest.fixture(autouse=True)
def at_once():
    """No test takes longer than SECONDS of work."""

    def late(*_):
        raise TimeoutError(f"more than {SECONDS} s")

    before = signal.signal(signal.SIGVTALRM, late)
    signal.setitimer(signal.ITIMER_VIRTUAL, SECONDS)
    yield
    signal.setitimer(signal.ITIMER_VIRTUAL, 0)
    signal.signal(signal.SIGVTALRM, before)


def refused(capsys, *words):
    """What the command line says in its one line."""
    assert main(list(map(str, words))) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert len(line) < 1100
    assert all(len(word) < 400 for word in line.split())
    return line


def campaign(folder, name, make):
    """A copy of the sample campaign whose held-out record is another file."""
    for path in SAMPLE.iterdir():
        if path.is_file():
            shutil.copy(path, folder)
    file = folder / "campaign.toml"
    file.write_text(file.read_text("utf-8").replace("multisine.csv.gz", name), "utf-8")
    make(folder / name)
    return folder


EXPERIMENTS = {
    "digits": (STEP.replace("points = 12", "points = " + "9" * 5000), "line 7: a number of too many digits"),
    "brackets": ("a = " + "[" * 2000, "nested too deeply"),
    "closed brackets": ("a = " + "[" * 2000 + "]" * 2000, "nested too deeply"),
    "a hundred brackets": ("a = " + "[" * 100 + "]" * 100, "nested too deeply"),
    "braces": ("a = " + "{a=" * 2000, "nested too deeply"),
    "dotted key": (".".join(["a"] * 20_000) + " = 1", "nested too deeply"),
    "quoted dotted key": (" . ".join(['"a"'] * 20_000) + " = 1", "nested too deeply"),
    "dotted header": ("[" + ".".join(["a"] * 20_000) + "]", "nested too deeply"),
    "list": ('experiment = ["step"]', "experiment = ['step']: write"),
    "NUL": (STEP.replace("controllers.p:P", "a\\u0000b.py:Law"), "line 10: controllers.p.use: holds a NUL character"),
    "NUL key": (STEP.replace("[controllers.p]", '[controllers."a\\u0000b"]'), "a key holds a NUL character"),
    "slash": (STEP.replace("[controllers.p]", '[controllers."a/b"]'), '"a/b" is no name to store results by'),
    "long name": (STEP.replace("[controllers.p]", f"[controllers.{'n' * 3000}]"), "a name of 3000 characters"),
    "long scenario": (STEP.replace("position-1mm", "q" * 3000), f'no scenario "{"q" * 76}...;'),
    "long class": (STEP.replace("p:P", "p:" + "q" * 3000), f"has no class {'q' * 77}..."),
    "long module": (STEP.replace("controllers.p:", "q" * 3000 + ":"), f"module named '{'q' * 60}...; write the module"),
    "long number": (STEP.replace("3.7 1/m", "9" * 100_000 + " 1/m"), "write a number and its unit"),
    "unit": (STEP.replace("3.7 1/m", "3.7 9**9**9**9 1/m"), 'unknown unit "9**9**9**9 1/m"'),
    "points": (STEP.replace("points = 12", "points = 1000000000"), "bode.points = 1000000000: must be a whole number"),
    "Bode above Nyquist's": (STEP.replace("= 30", "= 600"), "600 Hz is above half the control rate of jack-10t, 500"),
    "Bode without end": (STEP.replace("= 0.5", "= 1e-300"), "low_hz: 1e-300 Hz is below 0.001 Hz; raise it"),
    "scenario twice": (STEP.replace('"position-1mm"', '"position-1mm", "position-1mm"'), "is listed twice"),
    "scenario's slash": (
        STEP.replace('"position-1mm"', '"a/b"') + '[scenario."a/b"]\nsize = "1 mm"\nseconds = "1 s"',
        '"a/b" is no name',
    ),
    "sine above Nyquist's": (MINE + 'size = "1 mm"\nseconds = "1 s"\nfrequency = "700 Hz"', "outside 1e-06 to 500 Hz"),
    "road above Nyquist's": (
        MINE + 'seconds = "1 s"\nroad = {class = "A", speed = "9 m/s", low = "1 Hz", high = "900 Hz", seed = 1}',
        "road.high: 900 Hz is outside",
    ),
    "road without end": (
        MINE + 'seconds = "1e6 s"\nroad = {class = "A", speed = "9 m/s", low = "1 Hz", high = "90 Hz", seed = 1}',
        "is more than can be computed",
    ),
    "course without end": (MINE + 'size = "1 mm"\nseconds = "1e6 s"', "above 10000000 control periods of 1 ms"),
}


@pytest.mark.parametrize("case", EXPERIMENTS)
def test_an_odd_experiment_is_refused_in_one_line(case, tmp_path, capsys):
    text, words = EXPERIMENTS[case]
    (tmp_path / "e.toml").write_text(text, "utf-8")
    assert words in refused(capsys, "run", tmp_path / "e.toml", "--out", tmp_path / "out")
    assert not (tmp_path / "out.partial").exists()


RIGS = {
    "power": (STROKE, 'value = 0.5, unit = "9**9**9**9 m"', 'unknown unit "9**9**9**9 m"'),
    "letters": (STROKE, f'value = 0.5, unit = "{"m" * 100_000}"', "unknown unit"),
    "products": (STROKE, f'value = 0.5, unit = "{"m*" * 50_000}m"', "unknown unit"),
    "parentheses": (STROKE, f'value = 0.5, unit = "{"(" * 5000}m{")" * 5000}"', "unknown unit"),
    "kind": ('kind = "three-stage"', "kind = []", "valve.kind = []"),
    "noise": ("noise = {value = 0.04", "noise = {value = 400", "so the guard would see no speed; correct it"),
    "resolution": ("resolution = {value = 0.00916", "resolution = {value = 900", "sensors.position.resolution"),
}


@pytest.mark.parametrize("case", RIGS)
def test_an_odd_rig_is_refused_in_one_line(case, tmp_path, capsys):
    before, after, words = RIGS[case]
    assert before in RIG
    (tmp_path / "r.toml").write_text(RIG.replace(before, after), "utf-8")
    assert words in refused(capsys, "show", tmp_path / "r.toml")


@pytest.mark.parametrize(
    "unit", ["m**9**9**9", "((9)**9)**9", "m^(99)^99", "(1)**9**9", "2 m", "m" * 81, "m***2", "m^123456"]
)
def test_no_arithmetic_in_a_unit(unit):
    with pytest.raises(InputError, match="unknown unit"):
        units.to_si(1.0, unit, "m")


def test_units_as_people_write_them():
    for unit in (
        "m/s2",
        "m / s ** 2",
        "1/(bar s)",
        "l/min/bar^0.5",
        "kN s/m",
        "m^(1/2)",
        "µm",
        "%",
        "°C",
        "-",
        "inH2O",
    ):
        assert units.to_si(1.0, unit, unit) == pytest.approx(1.0)


ODD_FILES = {
    "FIFO": (lambda path: os.mkfifo(path), "is a pipe or a device"),
    "/dev/zero": (lambda path: path.symlink_to("/dev/zero"), "is a pipe or a device"),
    "folder": (lambda path: path.mkdir(), "is a folder"),
    "itself": (lambda path: path.symlink_to(path), "cannot be read (Too many levels of symbolic links)"),
}


@pytest.mark.parametrize("case", ODD_FILES)
def test_what_is_no_file_is_refused(case, tmp_path, capsys):
    make, words = ODD_FILES[case]
    for name, command in (("e.toml", "run"), ("r.toml", "show")):
        make(tmp_path / name)
        assert words in refused(capsys, command, tmp_path / name)
    (tmp_path / "c").mkdir()
    assert words in refused(capsys, "residual", campaign(tmp_path / "c", "a.csv", make))


def test_code_and_finished_runs_are_files(tmp_path, capsys):
    os.mkfifo(tmp_path / "mine.py")
    (tmp_path / "r.toml").write_text(f'effect_files = ["mine.py"]\n{RIG}\n[[effects]]\nname = "my.x"\n', "utf-8")
    assert "is a pipe or a device" in refused(capsys, "show", tmp_path / "r.toml")
    assert "is a pipe or a device" in refused(capsys, "trust", tmp_path / "mine.py")
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        os.mkfifo(tmp_path / name / "metrics.json")
        (tmp_path / name / "config.toml").touch()
    assert "is a pipe or a device" in refused(capsys, "compare", tmp_path / "a", tmp_path / "b")


def bomb(path):
    """Two gibibytes of zeros: the same compressed member over and over."""
    path.write_bytes(gzip.compress(b"0,0,0\n" * 2**20, mtime=0) * 350)


def wide(path):
    path.write_text(",".join(f"c{i}" for i in range(100_000)) + "\n" + ",".join("1" * 100_000) + "\n")


def wordy(path):
    path.write_text("t [s],command [1]," + "a b " * 5000 + "\n" + "0,0,0\n" * 20)


def talkative(path):
    path.write_text("t [s],command [1]\n" + "0,0\n" * 20 + "0," + "q" * 3000)


def unending(path):
    path.write_text("t [s],command [1]," + "a" * 200_000 + "\n" + "0,0,0\n" * 20)


def minute(path):
    rows = "".join(f"{k * 1e-3},0,{(k % 2) * 1e-250}\n" for k in range(200))
    path.write_text("t [s],command [1],position [mm]\n" + rows)


def milliseconds(path):
    path.write_text("t [s],command [1],position [9**9**9**9 m]\n" + "0,0,0\n" * 20)


def matlab73(path):
    with h5py.File(path, "w", userblock_size=512) as file:
        file.create_dataset("t", shape=(1, 10**10), chunks=(1, 10**6), compression="gzip", dtype="f8")


RECORDS = {
    "gz bomb": ("a.csv.gz", bomb, "more than 256 MiB, too large for a record"),
    "columns": ("a.csv", wide, "100000 columns"),
    "heading": ("a.csv", wordy, "a heading of 19999 characters"),
    "text": ("a.csv", talkative, f'column "command [1]": "{"q" * 76}... is not a number'),
    "cell": ("a.csv", unending, "row 1: field larger than field limit"),
    "a number that no rig has": ("a.csv", minute, 'column "position [mm]": 1e-253 m at most, which no rig has'),
    "unit": ("a.csv", milliseconds, 'unknown unit "9**9**9**9 m"'),
    "MAT 7.3 bomb": ("a.mat", matlab73, "10000000000 numbers are more than 256 MiB"),
    "MAT": ("a.mat", lambda path: path.write_bytes(b"MATLAB 7.3".ljust(512) + b"\x89HDF\r\n\x1a\n"), "broken mat file"),
    "Parquet": ("a.parquet", lambda path: path.write_bytes(b"PAR1" + b"\xff" * 500 + b"PAR1"), "broken parquet file"),
    "truncated Parquet": ("a.parquet", lambda path: path.write_bytes(b"PAR1\0\0"), "broken parquet file"),
    "name": ("m" * 5000, lambda _: None, "cannot be read (File name too long)"),
}


@pytest.mark.parametrize("case", RECORDS)
def test_an_odd_record_is_refused_in_one_line(case, tmp_path, capsys):
    name, make, words = RECORDS[case]
    assert words in refused(capsys, "residual", campaign(tmp_path, name, make))


def test_two_columns_of_one_name_may_stand_beside_those_that_are_used(tmp_path):
    numbers = pa.array(np.arange(20.0))
    names = ["t [s]", "command [1]", "x", "x"]
    pq.write_table(pa.Table.from_arrays([numbers] * 4, names=names), tmp_path / "a.parquet")
    assert read_record(tmp_path / "a.parquet").names == ("command",)


def test_a_gain_beyond_all_numbers_is_refused(tmp_path):
    path = tmp_path / "sheet.csv"
    path.write_text("frequency [Hz],gain [dB],phase [deg]\n" + "".join(f"{f},1e9,0\n" for f in range(1, 9)))
    with pytest.raises(InputError, match="must be above 0 and finite"):
        read_response(path, "1", "1")


def test_a_bomb_takes_little_memory(tmp_path):
    """The most that a process of its own ever had, which Linux tells."""
    folder = campaign(tmp_path, "a.csv.gz", bomb)
    code = (
        "import sys; from workbench.cli import main; status = main(['residual', sys.argv[1]])\n"
        "print([line.split()[1] for line in open('/proc/self/status') if line.startswith('VmHWM')][0])\n"
        "sys.exit(status)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(folder)], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert int(done.stdout) < 500 * 1024


def test_a_table_of_too_many_numbers_is_refused_unread(tmp_path):
    pq.write_table(pa.table({"t [s]": np.zeros(2**20)}), tmp_path / "a.parquet")
    whole = pq.ParquetFile(tmp_path / "a.parquet").metadata
    assert whole.num_rows == 2**20
    pq.write_table(pa.table({f"c{i}": pa.nulls(2**20) for i in range(33)}), tmp_path / "b.parquet")
    with pytest.raises(InputError, match="34603008 numbers are more than 256 MiB; split it"):
        read_record(tmp_path / "b.parquet")


def test_no_more_is_read_than_asked_for(tmp_path):
    (tmp_path / "a").write_bytes(bytes(2**20 + 1))
    with pytest.raises(InputError, match="more than 1 MiB"):
        read_bytes(tmp_path / "a", most=2**20)
    assert len(read_bytes(tmp_path / "a", most=2**20 + 1)) == 2**20 + 1


@pytest.mark.parametrize(
    "words",
    [
        ("run", "a" * 5000 + ".toml"),
        ("show", "r" * 5000),
        ("show", "r" * 5000 + ".toml"),
        ("run", "a\0b.toml"),
        ("run", "paper.toml", "--out", "o" * 300),
        ("run", "paper.toml", "--out", "o\0"),
        ("run", "paper.toml", "--picture", "p" * 300 + ".png"),
        ("run", "paper.toml", "--picture", "p\0.png"),
        ("run", "paper.toml", "--picture", "/dev/full/x.png"),
        ("run", "paper.toml", "--out", "/dev/full/x"),
        ("run", "caf\udce9.toml"),
        ("run", "paper.toml", "--out", "caf\udce9"),
        (*EXCITE, "--repeat", "1000000000"),
        (*EXCITE, "--band", "1", "900"),
    ],
)
def test_odd_words_are_refused_before_anything_is_computed(words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    paper = ROOT / "experiments" / "paper.toml"
    refused(capsys, *(paper if word == "paper.toml" else word for word in words))
    assert not list(tmp_path.iterdir())


def test_a_full_disk_is_one_line_and_a_bug_is_not(tmp_path, monkeypatch, capsys):
    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "metrics.json")

    monkeypatch.setattr(run_folder, "write_whole", full)
    paper = ROOT / "experiments" / "paper.toml"
    assert "metrics.json: No space left on device" in refused(capsys, "run", paper, "--out", tmp_path / "out")
    monkeypatch.setattr(run_folder, "write_whole", lambda *_: (_ for _ in ()).throw(OSError("a bug")))
    with pytest.raises(OSError, match="a bug"):
        main(["run", str(paper), "--out", str(tmp_path / "other")])


def test_names_that_are_no_utf_8_are_one_line_wherever_they_come_from(tmp_path, monkeypatch, capsys):
    folder = os.fsdecode(os.fsencode(tmp_path) + b"/caf\xe9")
    try:
        os.mkdir(folder)
    except OSError:
        pytest.skip("this disk takes UTF-8 alone")
    monkeypatch.chdir(folder)
    refused(capsys, "run", ROOT / "experiments" / "paper.toml", "--out", "out")
    assert not os.listdir(".")


def test_a_full_disk_behind_the_output_is_one_line(monkeypatch, capsys):
    class Full(io.StringIO):
        def flush(self):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(sys, "stdout", Full())
    assert main(["list", "rigs"]) == 2
    assert "No space left on device" in capsys.readouterr().err


def test_an_echo_is_short():
    for value in ("x" * 10**6, list(range(10**5)), {"a": "b" * 10**5}, 10**5000, b"\0" * 10**5):
        assert len(echo(value)) <= 80


def in_milliseconds(path):
    rows = gzip.decompress(path.read_bytes()).decode().splitlines()
    late = [f"{1000 * float(row.split(',', 1)[0])},{row.split(',', 1)[1]}" for row in rows[1:]]
    path.write_bytes(gzip.compress("\n".join([rows[0], *late, ""]).encode(), 1))


def test_milliseconds_under_a_heading_of_seconds(tmp_path, capsys):
    campaign(tmp_path, "multisine.csv.gz", lambda path: None)
    for path in tmp_path.glob("*.gz"):
        in_milliseconds(path)
    line = refused(capsys, "residual", tmp_path)
    assert "a row every 1 s, and the control period of jack-10t is 1 ms; it looks like ms under s" in line


@pytest.mark.parametrize("copy", ["./multisine.csv.gz", "link.csv.gz", "steps.csv.gz"])
def test_a_heldout_record_is_listed_once_and_nowhere_else(copy, tmp_path, capsys):
    campaign(tmp_path, "multisine.csv.gz", lambda path: None)
    (tmp_path / "link.csv.gz").symlink_to("multisine.csv.gz")
    file = tmp_path / "campaign.toml"
    text = file.read_text("utf-8").replace('"multisine.csv.gz"', f'"multisine.csv.gz", "{copy}"')
    file.write_text(text, "utf-8")
    line = refused(capsys, "residual", tmp_path)
    assert "list them once" in line or "listed twice" in line or "is also in train" in line


def test_a_heldout_record_is_not_static(tmp_path, capsys):
    campaign(tmp_path, "multisine.csv.gz", lambda path: None)
    file = tmp_path / "campaign.toml"
    file.write_text(file.read_text("utf-8").replace("static.csv.gz", "multisine.csv.gz"), "utf-8")
    assert "has the samples of multisine.csv.gz in static" in refused(capsys, "residual", tmp_path)
