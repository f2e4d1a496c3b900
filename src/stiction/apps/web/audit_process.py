"""Go on with an audit, in a process of its own: ``python -m stiction.apps.web.audit_process FOLDER``."""

from __future__ import annotations

import sys
from typing import Any

from stiction.errors import StictionError

__all__ = ["main"]


def main(folder: str) -> int:
    """Run the audit of a folder again with its own options; return an exit code."""
    from stiction.fleet import audit, open_audit
    from stiction.fleet.audit_options import RUN_OPTIONS

    known = open_audit(folder)
    names = ("loops", "signals", "connections", "reading")
    options: dict[str, Any] = {name: known.settings.get(name) for name in names}
    options |= {name: known.run[name] for name in ("since", "until", *RUN_OPTIONS)}
    try:
        audit(known.settings["sources"], folder, **options)
    except StictionError as error:
        print(error, file=sys.stderr)
        return 3
    except KeyboardInterrupt:
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
