"""The FMU of FMI 3.0: co-simulation with PythonFMU3."""

from __future__ import annotations

from pythonfmu3 import Float64, Fmi3Causality, Fmi3Initial, Fmi3Slave, Fmi3Variability, Unit

from bushcli.export.fmu.slave import Variables


class Bushing(Fmi3Slave, Variables):  # type: ignore[misc]  # its type is not known
    """A bushing's force law."""

    def __init__(self, **options):  # type: ignore[no-untyped-def]  # of PythonFMU3
        super().__init__(**options)
        self.load()
        self.modelName = self.data["name"]
        self.description = self.data["description"]
        self.time = 0.0
        self.register_units(
            [
                Unit(
                    name,
                    factor=float(base.get("factor", 1.0)),
                    **{k: int(v) for k, v in base.items() if k != "factor"},
                )
                for name, base in self.data["base_units"].items()
            ]
        )
        self.register_variable(
            Float64("time", causality=Fmi3Causality.independent, variability=Fmi3Variability.continuous)
        )
        for variable in self.variables(Float64, Fmi3Causality, Fmi3Initial, Fmi3Variability, True):
            self.register_variable(variable)

    def exit_initialization_mode(self):  # type: ignore[no-untyped-def]
        """Begin at rest."""
        self.initialise()

    def do_step(self, current_time, step_size):  # type: ignore[no-untyped-def]
        """Take a step."""
        self.advance(step_size)
        self.time = current_time + step_size
        return True
