"""The graphs of a model as C, compiled and packed with their description."""

import platform
import subprocess
import sys
from collections.abc import Iterable
from hashlib import sha256
from importlib.metadata import version
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from zipfile import ZIP_DEFLATED, ZipFile

import casadi as ca
import numpy as np

from ...control.export.program import identifier
from ...engine.engine import ATTEMPTS, FIRST_STEP, TOLERANCE
from ...engine.rosenbrock import SMALLEST
from ...engine.sampled_law import OUT
from ..common.new_folder import write_folder
from .compiler import compiler
from .description import SOURCES, model_description
from .model import FmuModel

_HERE = Path(__file__).parent
_PLATFORMS = {"Linux": ("linux64", ".so"), "Darwin": ("darwin64", ".dylib"), "Windows": ("win64", ".dll")}
_FLAGS = ("-std=c99", "-O1", "-fPIC", "-shared", "-fvisibility=hidden", "-ffp-contract=off")


def leave_fmu(folder: Path, name: str, model: FmuModel) -> str:
    """A new folder with the file of a model; what it is, for people."""
    write_folder(folder, {name: fmu(model, version("jackbench"))})
    inputs = ", ".join(variable.name for variable in model.inputs)
    return f"{folder / name}: {inputs} in, {len(model.outputs)} signals out"


def fmu(model: FmuModel, version: str) -> bytes:
    """The .fmu file. Raises InputError where there is no compiler."""
    sources = {"plant.c": _plant(model.graphs), "fmi2.h": _text("fmi2.h"), "fmu.c": _text("fmu.c")}
    header = _header(model)
    guid = sha256("".join([version, header, *sources.values()]).encode()).hexdigest()[:32]
    sources["model.h"] = f'#define GUID "{guid}"\n{header}'
    folder, suffix = _PLATFORMS.get(platform.system(), _PLATFORMS["Linux"])
    packed = BytesIO()
    with ZipFile(packed, "w", ZIP_DEFLATED) as archive:
        archive.writestr("modelDescription.xml", model_description(model, guid, version))
        archive.writestr(f"binaries/{folder}/{identifier(model.name)}{suffix}", _compiled(sources))
        for name, text in sources.items():
            archive.writestr(f"sources/{name}", text)
    return packed.getvalue()


def _text(name: str) -> str:
    return (_HERE / name).read_text("utf-8")


def _plant(graphs: Iterable[ca.Function]) -> str:
    code = ca.CodeGenerator("plant.c")
    for graph in graphs:
        code.add(graph)
    return code.dump()


def _header(model: FmuModel) -> str:
    """Sizes, start values, and the graphs' signatures."""
    loop, graphs = model.loop, model.graphs
    sizes = {
        "STATES": model.plant.n,
        "INPUTS": len(model.inputs),
        "OUTPUTS": len(model.plant.outputs),
        "PARAMETERS": len(model.plant.parameters),
        "LAW": int(loop is not None),
        "LAW_STATES": len(loop.state) if loop else 1,
        "PUT_OUT": len(OUT) if loop else 0,
        "INTERVALS": len(loop.durations) if loop else 1,
        "PERIOD": repr(model.period),
        "TOLERANCE": repr(TOLERANCE),
        "FIRST_STEP": repr(FIRST_STEP),
        "SMALLEST": repr(SMALLEST),
        "ATTEMPTS": ATTEMPTS,
        "WORK": max(graph.sz_w() for graph in graphs) + 1,
        "INTEGERS": max(graph.sz_iw() for graph in graphs) + 1,
    }
    reference = [variable.start for variable in model.inputs]
    arrays = {
        "start_x": model.x,
        "start_u": np.array(reference),
        "start_p": model.plant.p,
        "constant_p": np.array([float(name in model.delays) for name in model.plant.parameters]),
        "nominal_x": model.plant.scale,
    }
    if loop:
        arrays |= {"start_law": loop.state, "numbers": loop.numbers, "durations": loop.durations}
    lines = [f"#define {name} {value}" for name, value in sizes.items()]
    lines.append("typedef long long int casadi_int;")
    for graph in graphs:
        lines.append(f"int {graph.name()}(const double **, double **, casadi_int *, double *, int);")
    for name, values in arrays.items():
        lines.append(f"static const double {name}[] = {{{', '.join(map(repr, values.tolist()))}}};")
    return "\n".join(lines) + "\n"


def _compiled(sources: dict[str, str]) -> bytes:
    with TemporaryDirectory() as place:
        for name, text in sources.items():
            Path(place, name).write_text(text, encoding="utf-8")
        command = [compiler(), *_FLAGS, "-o", "model", *SOURCES, "-lm"]
        done = subprocess.run(command, cwd=place, capture_output=True, text=True, check=False)
        if done.returncode:
            print(done.stderr, file=sys.stderr)
            raise RuntimeError("the C code of the FMU does not compile")
        return Path(place, "model").read_bytes()
