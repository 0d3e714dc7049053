"""The FMU of FMI 2.0: co-simulation with PythonFMU."""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement

from pythonfmu import Fmi2Causality, Fmi2Initial, Fmi2Slave, Fmi2Variability, Real

from bushcli.export.fmu.slave import Variables


class Bushing(Fmi2Slave, Variables):  # type: ignore[misc]  # its type is not known
    """A bushing's force law."""

    def __init__(self, **options):  # type: ignore[no-untyped-def]  # of PythonFMU
        super().__init__(**options)
        self.load()
        self.modelName = self.data["name"]
        self.description = self.data["description"]
        self.unit_of = {name: unit for name, unit, *_ in (*self.inputs(), *self.outputs())}
        for variable in self.variables(Real, Fmi2Causality, Fmi2Initial, Fmi2Variability, False):
            self.register_variable(variable)

    def to_xml(self, model_options=None):  # type: ignore[no-untyped-def]
        """Return the model's description with the units and the outputs to initialise, which PythonFMU leaves out."""
        root = super().to_xml(model_options or {})
        definitions = Element("UnitDefinitions")
        for unit, base in self.data["base_units"].items():
            SubElement(SubElement(definitions, "Unit", name=unit), "BaseUnit", base)
        root.insert(1, definitions)
        for variable in root.find("ModelVariables"):
            unit = self.unit_of.get(variable.get("name"))
            if unit is not None:
                variable.find("Real").set("unit", unit)
        structure = root.find("ModelStructure")
        initial = SubElement(structure, "InitialUnknowns")
        for output in structure.findall("Outputs/Unknown"):
            SubElement(initial, "Unknown", index=output.get("index"))
        return root

    def exit_initialization_mode(self):  # type: ignore[no-untyped-def]
        """Begin at rest."""
        self.initialise()

    def do_step(self, current_time, step_size):  # type: ignore[no-untyped-def]
        """Take a step."""
        self.advance(step_size)
        return True
