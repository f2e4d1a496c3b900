"""``stiction read``: what a source holds, without a diagnosis."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from stiction.apps.failure import traceback_of
from stiction.apps.options import Json, in_options, refuse_options
from stiction.apps.reading_options import SOURCES, ReadingOptions, read_sources
from stiction.errors import ParameterError, RecordError

if TYPE_CHECKING:
    from stiction.apps.failure import Failure
    from stiction.sources.roles.loop_roles import LoopRoles

__all__ = ["read"]

_FORMS = {"--out": (".parquet", b"PAR1"), "--write-map": (".csv", b"tag,loop,role,")}
"""Option -> how the name of its file ends, and how the file begins."""
File = Annotated[str | None, Parameter(allow_leading_hyphen=True)]


def read(
    *sources: Annotated[str, Parameter(name="SOURCE", help=SOURCES, allow_leading_hyphen=True)],
    out: File = None,
    write_map: File = None,
    as_json: Json = False,
    reading: ReadingOptions = ReadingOptions(),  # noqa: B008 (frozen)
) -> int:
    """Say what a source holds: loops, rows, step, units, assumptions, bad values, gaps and columns not used.

    Exit code 0, or 3 when a source could not be read; nothing is written then.

    Parameters
    ----------
    out
        Parquet file to write the loops to; reading it gives equal loops at once.
    write_map
        Mapping file to write, in which each column's loop, role and unit can be corrected; read it back with --map.
        An existing map with other rows is left alone.
    as_json
        Print an object with the loops, the assumptions and the sources that could not be read, and nothing else.
    """
    refuse_options(sources, read)
    if not sources:
        raise ParameterError(
            "no source was named; give files, a folder, a pattern, a database URL, or - for the standard input."
        )
    targets = _check_targets(sources, out, write_map)
    from stiction.apps.output import note, print_json, say
    from stiction.records import summarise

    found = read_sources(sources, reading.arguments())
    if write_map is not None and not any(loops.roles for loops in found.loops) and not found.failures:
        raise RecordError("the source holds stored loops without columns to map; leave --write-map out.")
    roles = [loop for loops in found.loops for loop in loops.roles]
    if "--write-map" in targets and not found.failures:
        _keep_edited_map(targets["--write-map"], roles)
    summary = summarise(found.records)
    if as_json:
        print_json({**summary.to_dict(), "failures": [_as_object(failure) for failure in found.failures]})
    elif found.records:
        say(in_options(summary.summary()))
    if found.failures:
        for failure in found.failures:
            if failure.fault is not None:
                note(traceback_of(failure.fault))
        raise _failure_error(found.failures)
    if "--out" in targets:
        from stiction.records.parquet_writer import to_parquet

        to_parquet(found.records, targets["--out"])
    if "--write-map" in targets:
        from stiction.sources.roles.map_file import write_map as write

        write(roles, targets["--write-map"])
    for option, target in targets.items():
        (note if as_json else say)(f"{'Loops' if option == '--out' else 'Map'}: {target}")
    return 0


def _keep_edited_map(target: Path, roles: "list[LoopRoles]") -> None:
    """Refuse to replace a map with other rows, which may have been edited by hand."""
    from stiction.sources.roles.map_file import map_text

    if target.exists() and target.read_bytes() != map_text(roles).encode():
        raise RecordError(
            f"{target} exists and has other rows than the map to be written, perhaps edited by hand; name another file "
            "with --write-map, or delete it first."
        )


def _failure_error(failures: "list[Failure]") -> Exception:
    """The error that ends the command: a fault of the program, the only reason, or all of them."""
    faults = [failure.fault for failure in failures if failure.fault is not None]
    if faults:
        return faults[0]
    if len(failures) == 1:
        return RecordError(failures[0].reason)
    reasons = " ".join(f"({k}) {failure.reason}" for k, failure in enumerate(failures, 1))
    return RecordError(f"{len(failures)} sources could not be read: {reasons}")


def _as_object(failure: "Failure") -> dict[str, str]:
    return {"file": failure.file, "reason": failure.reason, "action": failure.remedy}


def _check_targets(sources: tuple[str, ...], out: str | None, write_map: str | None) -> dict[str, Path]:
    """Check the files to write before the work: they are of the right kind, and replace no source."""
    from stiction.apps.files import check_target

    targets: dict[str, Path] = {}
    for option, name in (("--out", out), ("--write-map", write_map)):
        if name is None:
            continue
        ending, start = _FORMS[option]
        if not name.lower().endswith(ending):
            raise ParameterError(f"{option} {name} does not end in {ending}; give a name that does.")
        target = check_target(name)
        if any(target.resolve() == Path(source).resolve() for source in sources):
            raise ParameterError(f"{option} {name} would replace the source; name another file.")
        if target.exists() and not (target.is_file() and target.read_bytes()[: len(start)] == start):
            raise RecordError(f"{target} was not written by stiction and is left alone; name another with {option}.")
        targets[option] = target
    return targets
