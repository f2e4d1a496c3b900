"""Go on with an audit: ``python -m stiction.apps.web.audit_process FOLDER``, the process behind "Go on"."""

from __future__ import annotations

import sys

from stiction.errors import StictionError

__all__ = ["main"]


def main(folder: str) -> int:
    """Run the audit of a folder again with its own settings; return an exit code."""
    from stiction.fleet import audit, open_audit

    known = open_audit(folder)
    run = known.run
    try:
        audit(
            known.settings["sources"], folder, loops=known.settings.get("loops"),
            signals=known.settings.get("signals"), reading=known.settings.get("reading"),
            since=run.get("since"), until=run.get("until"),
        )  # fmt: skip
    except StictionError as error:
        print(error, file=sys.stderr)
        return 3
    except KeyboardInterrupt:
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
