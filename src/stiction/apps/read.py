"""``stiction read``: show what a source holds, without a diagnosis."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from stiction.apps.failure import traceback_text
from stiction.apps.options import JsonOption, reject_misplaced_options
from stiction.apps.reading_options import SOURCES, ReadingOptions, read_sources
from stiction.errors import ParameterError, RecordError

if TYPE_CHECKING:
    from stiction.apps.failure import Failure
    from stiction.sources.roles.loop_roles import LoopRoles

__all__ = ["read"]

_FORMS = {"--out": (".parquet", b"PAR1"), "--write-map": (".csv", b"tag,loop,role,")}
"""Option -> how the names of its files end, and how the files begin."""
File = Annotated[str | None, Parameter(allow_leading_hyphen=True)]


def read(
    *sources: Annotated[str, Parameter(name="SOURCE", help=SOURCES, allow_leading_hyphen=True)],
    out: File = None,
    write_map: File = None,
    as_json: JsonOption = False,
    reading: ReadingOptions = ReadingOptions(),  # noqa: B008 (frozen)
) -> int:
    """Show what a source holds: loops, rows, sampling period, units, assumptions, bad values, gaps and unused columns.

    Exit code 0, or 3 when nothing could be read; then nothing is written. Files that could not be read are named.

    Parameters
    ----------
    out
        Parquet file to write the loops to; it is read back quickly and without options.
    write_map
        Mapping file to write, in which you can correct the loop, role and unit of each column; use it with --map. An
        existing map with other rows is not replaced.
    as_json
        Print only a JSON object with the loops, the assumptions and the sources that could not be read.
    """
    reject_misplaced_options(sources, read)
    if not sources:
        raise ParameterError(
            "no source was given; give files, a folder, a pattern, a database URL, or - for the standard input."
        )
    targets = _check_targets(sources, out, write_map)
    from stiction.apps.output import print_err, print_json, print_out
    from stiction.records import summarise

    contents = read_sources(sources, reading.arguments())
    if write_map is not None and not any(loops.roles for loops in contents.loops) and contents.records:
        raise RecordError(
            "the source contains loops that stiction stored, so there are no columns to map; leave --write-map out."
        )
    roles = [loop for loops in contents.loops for loop in loops.roles]
    if "--write-map" in targets and contents.records:
        _keep_edited_map(targets["--write-map"], roles)
    summary = summarise(contents.records)
    if as_json:
        print_json({**summary.to_dict(), "failures": [_as_object(failure) for failure in contents.failures]})
    elif contents.records:
        print_out(summary.summary())
    if contents.failures:
        for failure in contents.failures:
            if failure.fault is not None:
                print_err(traceback_text(failure.fault))
        if not contents.records:
            raise _failure_error(contents.failures)
        for failure in contents.failures:
            print_err(f"Not read: {failure.reason}")
    if "--out" in targets:
        from stiction.records.parquet_writer import to_parquet

        to_parquet(contents.records, targets["--out"])
    if "--write-map" in targets:
        from stiction.atomic_write import write_atomically
        from stiction.sources.roles.map_file import map_text

        write_atomically(map_text(roles), targets["--write-map"])
    for option, target in targets.items():
        (print_err if as_json else print_out)(f"{'Loops' if option == '--out' else 'Map'}: {target}")
    return 0


def _keep_edited_map(target: Path, roles: "list[LoopRoles]") -> None:
    """Refuse to replace a map with other rows, which may have been edited by hand."""
    from stiction.sources.roles.map_file import map_text

    if target.exists() and target.read_bytes() != map_text(roles).encode():
        raise RecordError(
            f"{target} exists with other rows than the new map; someone may have edited it. Give another name with "
            "--write-map, or delete the file first."
        )


def _failure_error(failures: "list[Failure]") -> Exception:
    """Return the error that ends the command: an error in the program, or the reasons of all failures."""
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
    """Check the files to write before the work: their names fit, and they do not replace a source."""
    from stiction.apps.output_files import check_target

    targets: dict[str, Path] = {}
    for option, name in (("--out", out), ("--write-map", write_map)):
        if name is None:
            continue
        ending, start = _FORMS[option]
        if not name.lower().endswith(ending):
            raise ParameterError(f"{option} {name} does not end in {ending}; give a name that ends in {ending}.")
        target = check_target(name)
        if any(target.resolve() == Path(source).resolve() for source in sources):
            raise ParameterError(f"{option} {name} would replace the source; give another name.")
        if target.exists() and not (target.is_file() and target.read_bytes()[: len(start)] == start):
            raise RecordError(
                f"{target} was not written by stiction and is not replaced; give another name with {option}."
            )
        targets[option] = target
    return targets
