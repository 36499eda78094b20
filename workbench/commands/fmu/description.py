"""modelDescription.xml of an FMU: variables in the order of fmu.c, units, and what depends on what."""

from xml.etree import ElementTree

from ...base.units import base_units
from ...control.export.program import identifier
from .model import FmuModel, FmuVariable

SOURCES = ("fmu.c", "plant.c")
_SYMBOLS = {
    "kilogram": "kg", "meter": "m", "second": "s", "ampere": "A", "kelvin": "K", "mole": "mol", "candela": "cd",
    "radian": "rad",
}  # fmt: skip


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
