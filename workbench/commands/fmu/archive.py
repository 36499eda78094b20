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
from xml.etree import ElementTree
from zipfile import ZIP_DEFLATED, ZipFile

import casadi as ca
import numpy as np

from ...base.units import base_units
from ...control.export.program import identifier
from ...engine.engine import ATTEMPTS, FIRST_STEP, TOLERANCE
from ...engine.rosenbrock import SMALLEST
from ...engine.sampled_law import OUT
from ..common.new_folder import write_folder
from .compiler import compiler
from .model import FmuModel, FmuVariable

_HERE = Path(__file__).parent
_PLATFORMS = {"Linux": ("linux64", ".so"), "Darwin": ("darwin64", ".dylib"), "Windows": ("win64", ".dll")}
_FLAGS = ("-std=c99", "-O1", "-fPIC", "-shared", "-fvisibility=hidden", "-ffp-contract=off")
SOURCES = ("fmu.c", "plant.c")
_SYMBOLS = {
    "kilogram": "kg", "meter": "m", "second": "s", "ampere": "A", "kelvin": "K", "mole": "mol", "candela": "cd",
    "radian": "rad",
}  # fmt: skip


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


def model_description(model: FmuModel, guid: str, version: str) -> bytes:
    """The XML file. `guid` says which build of the code it belongs to."""
    root = ElementTree.Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=model.name,
        guid=guid,
        description=model.title or model.name,
        generationTool=f"jackbench {version}",
        variableNamingConvention="flat",
        numberOfEventIndicators="0",
    )
    _kinds(root, model)
    _units(root, model)
    experiment = {"startTime": "0", "stopTime": "1", "tolerance": "1e-6", "stepSize": repr(model.period)}
    variables = ElementTree.Element("ModelVariables")
    _variables(variables, model)
    ElementTree.SubElement(root, "DefaultExperiment", experiment)
    root.append(variables)
    _structure(root, model)
    ElementTree.indent(root)
    return ElementTree.tostring(root, "utf-8", xml_declaration=True)


def _kinds(root: ElementTree.Element, model: FmuModel) -> None:
    both = {
        "modelIdentifier": identifier(model.name),
        "canGetAndSetFMUstate": "true",
        "canSerializeFMUstate": "true",
        "providesDirectionalDerivative": "true",
    }
    for kind, more in (("ModelExchange", {}), ("CoSimulation", {"canHandleVariableCommunicationStepSize": "true"})):
        files = ElementTree.SubElement(ElementTree.SubElement(root, kind, {**both, **more}), "SourceFiles")
        for name in SOURCES:
            ElementTree.SubElement(files, "File", name=name)


def _units(root: ElementTree.Element, model: FmuModel) -> None:
    listed = [*model.states, *model.inputs, *model.outputs, *model.parameters]
    units = dict.fromkeys(variable.unit for variable in listed if variable.unit)
    units |= dict.fromkeys(_rate(state.unit) for state in model.states)
    definitions = ElementTree.SubElement(root, "UnitDefinitions")
    for unit in units:
        element = ElementTree.SubElement(definitions, "Unit", name=unit)
        factor, powers = base_units(unit)
        if all(power == int(power) for power in powers.values()):
            exponents = {_SYMBOLS[base]: str(int(power)) for base, power in powers.items()}
            ElementTree.SubElement(element, "BaseUnit", {**exponents, "factor": repr(factor)})


def _rate(unit: str) -> str:
    return "1/s" if unit == "1" else f"({unit})/s"


def _variables(parent: ElementTree.Element, model: FmuModel) -> None:
    """In the order of their value references: states, derivatives, inputs, outputs, parameters."""
    for state in model.states:
        _variable(parent, state, "local", "continuous", "exact")
    for i, state in enumerate(model.states, 1):
        rate = FmuVariable(f"der({state.name})", _rate(state.unit), f"rate of {state.name}")
        _variable(parent, rate, "local", "continuous", "calculated", derivative=str(i))
    for variable in model.inputs:
        _variable(parent, variable, "input", "continuous")
    for i, variable in enumerate(model.outputs):
        sampled = i >= len(model.plant.outputs)
        _variable(parent, variable, "output", "discrete" if sampled else "continuous", "calculated")
    for variable in model.parameters:
        kind = ("local", "constant") if variable.name in model.delays else ("parameter", "fixed")
        _variable(parent, variable, *kind, "exact")


def _variable(
    parent: ElementTree.Element,
    variable: FmuVariable,
    causality: str,
    variability: str,
    initial: str | None = None,
    **more: str,
) -> None:
    names = {"name": variable.name, "valueReference": str(len(parent)), "description": variable.meaning}
    kinds = {"causality": causality, "variability": variability} | ({"initial": initial} if initial else {})
    numbers = {"unit": variable.unit, "start": variable.start, "nominal": variable.nominal}
    values = {key: value if isinstance(value, str) else repr(value) for key, value in numbers.items() if value}
    if variable.start == 0:
        values["start"] = "0.0"
    ElementTree.SubElement(ElementTree.SubElement(parent, "ScalarVariable", names | kinds), "Real", values | more)


def _structure(root: ElementTree.Element, model: FmuModel) -> None:
    """Without dependencies: every output and derivative may depend on all states and inputs."""
    n, inputs, outputs = len(model.states), len(model.inputs), len(model.outputs)
    rates = range(n + 1, 2 * n + 1)
    after = range(2 * n + inputs + 1, 2 * n + inputs + outputs + 1)
    structure = ElementTree.SubElement(root, "ModelStructure")
    for name, indices in (("Outputs", after), ("Derivatives", rates), ("InitialUnknowns", (*rates, *after))):
        part = ElementTree.SubElement(structure, name)
        for index in indices:
            ElementTree.SubElement(part, "Unknown", index=str(index))
