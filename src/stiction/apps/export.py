"""``stiction export``: write a model for another simulator."""

from typing import Annotated

from cyclopts import Parameter

from stiction.apps.options import JsonOption

__all__ = ["export"]


def export(
    model: str,
    *,
    parameter: Annotated[tuple[str, ...], Parameter(negative="")] = (),
    dt: float,
    fmu: str | None = None,
    c: str | None = None,
    modelica: str | None = None,
    matlab: str | None = None,
    fmi: str = "2.0",
    name: str | None = None,
    as_json: JsonOption = False,
) -> int:
    """Write a valve or a compensator for another simulator: as an FMU, as C, for Modelica or for MATLAB.

    Parameters
    ----------
    model
        Valve or compensator: kano, choudhury, stenman, he, hewang, srinivasan, physical, knocker, two-move, ..., or
        with its parameters, such as kano:S=5,J=2.
    parameter
        A parameter of the model, such as S=5; give the option once for each.
    dt
        Sampling period in seconds: the model takes one sample each.
    fmu
        FMU to write, for co-simulation; with a C compiler it holds a binary for this platform.
    c
        Folder for a C header and source.
    modelica
        Modelica file to write, with a block that calls the C source in it.
    matlab
        MATLAB function file to write.
    fmi
        Version of the FMU: 2.0 or 3.0.
    name
        Name of the exported model; that of the file when not given.
    as_json
        Print what was written as JSON.
    """
    from stiction import export as room
    from stiction.apps.output import print_json, print_out
    from stiction.apps.parse_model import parse_valve_or_compensator
    from stiction.atomic_write import output_path, require_new_file
    from stiction.errors import ParameterError

    asked = {"fmu": fmu, "c": c, "modelica": modelica, "matlab": matlab}
    asked = {form: path for form, path in asked.items() if path is not None}
    if not asked:
        raise ParameterError(
            "there is nothing to write; give --fmu FILE, --c FOLDER, --modelica FILE or --matlab FILE."
        )
    made = parse_valve_or_compensator(",".join([model if ":" in model else f"{model}:", *parameter]).replace(":,", ":"))
    places = [output_path(path).resolve() for path in asked.values()]
    if len(set(places)) < len(places):
        raise ParameterError("two options name the same path; give each form a path of its own.")
    for form, path in asked.items():
        if form != "c":  # its folder may exist; its files are checked before either is written
            require_new_file(path)
    written = []
    for form, path in asked.items():
        more = {"fmi": fmi} if form == "fmu" else {}
        written.append(getattr(room, f"export_{form}")(made, path, dt=dt, name=name, **more))
    if as_json:
        print_json([one.to_dict() for one in written])
    else:
        for one in written:
            print_out(one.summary())
    return 0
