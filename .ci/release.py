"""Builds the sdist, the wheel from the sdist, and tries the wheel in an empty environment and an empty folder.

With a version as argument (`make release VERSION=0.2.0`) it first refuses a tree that is not committed and files that
state another version, and at the end prints what is left to do by hand; without one (`make wheel`) it builds and tries.
"""

import os
import re
import subprocess
import sys
import tempfile
import venv
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
STATED = {
    "pyproject.toml": r'^version = "(.+)"$',
    "CITATION.cff": r"^version: (.+)$",
    "CHANGELOG.md": r"^## (\S+), ",
    "README.md": r"jackbench-(\S+?)-py3-none-any\.whl",
    "docs/first_hour/index.md": r"jackbench-(\S+?)-py3-none-any\.whl",
    "docs/how/install.md": r"jackbench-(\S+?)-py3-none-any\.whl",
}  # the first place of each file that states the version
DATED = {"CITATION.cff": r"^date-released: (\S+)$", "CHANGELOG.md": r"^## \S+, (\d{4}-\d\d-\d\d)$"}
TRIED = (["--version"], ["list", "rigs"], ["run", "paper"])
BY_HAND = """
{version} is built in dist/. Left to do by hand:
  .ci/run                                         where it has not passed on this commit
  git tag -a v{version} -m "jackbench {version}" && git push origin v{version}
  twine upload dist/jackbench-{version}*          where the wheel is to be found
  make docs                                       and put docs/_build/html where the site is served
"""


def stated(root: Path, places: dict[str, str]) -> dict[str, str]:
    """What each file of a tree states: the group of its pattern's first match, `nothing` without one."""
    found = {name: re.search(pattern, (root / name).read_text("utf-8"), re.M) for name, pattern in places.items()}
    return {name: match[1] if match else "nothing" for name, match in found.items()}


def disagreements(root: Path, version: str) -> Iterator[str]:
    """One line for each file that states another version, and one where the dates of the release differ."""
    for name, other in stated(root, STATED).items():
        if other != version:
            yield f"{name} states {other} as the version, not {version}"
    dates = stated(root, DATED)
    if "nothing" in dates.values() or len(set(dates.values())) > 1:
        yield f"the day of the release: {', '.join(f'{name} states {date}' for name, date in dates.items())}"


def uncommitted(root: Path) -> Iterator[str]:
    """One line for each file that the last commit does not hold as it stands."""
    listed = subprocess.run(["git", "status", "--porcelain"], cwd=root, capture_output=True, text=True, check=True)
    yield from (f"{line[3:]} is not committed" for line in listed.stdout.splitlines())


def built(into: Path) -> Path:
    """The wheel, built from the sdist beside it, so that the sdist is known to be whole. Older ones are removed."""
    for old in into.glob("jackbench-*"):
        old.unlink()
    subprocess.run([sys.executable, "-m", "hatchling", "build", "-t", "sdist", "-d", str(into)], cwd=ROOT, check=True)
    (sdist,) = into.glob("jackbench-*.tar.gz")
    quiet = ["--quiet", "--no-deps", "--no-build-isolation", "--wheel-dir", str(into)]
    subprocess.run([sys.executable, "-m", "pip", "wheel", *quiet, str(sdist)], check=True)
    (wheel,) = into.glob("jackbench-*.whl")
    return wheel


def tried(wheel: Path) -> None:
    """Install the wheel beside nothing else and run TRIED there. Raises CalledProcessError where one fails."""
    with tempfile.TemporaryDirectory() as scratch:
        venv.create(Path(scratch, "env"), with_pip=True, symlinks=True)
        commands = Path(scratch, "env", "bin")
        folder = Path(scratch, "empty")
        folder.mkdir()
        ours = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
        subprocess.run([commands / "pip", "install", "--quiet", str(wheel)], cwd=folder, env=ours, check=True)
        for words in TRIED:
            print("$ jackbench", *words, flush=True)
            subprocess.run([commands / "jackbench", *words], cwd=folder, env=ours, check=True)


def main(version: str | None = None) -> int:
    """Build and try; 1 where the tree is not that of a version that is asked for."""
    if version is not None:
        wrong = [*uncommitted(ROOT), *disagreements(ROOT, version)]
        if wrong:
            print("\n".join(wrong), file=sys.stderr)
            return 1
    tried(built(ROOT / "dist"))
    if version is not None:
        print(BY_HAND.format(version=version))
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
