"""Uploaded files: raw bodies, counted while they arrive, stored under names of our own."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, field
from itertools import count
from typing import TYPE_CHECKING

from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from starlette.requests import Request

__all__ = ["ROUTES", "Upload", "Uploads"]

MEGABYTE = 1_000_000
MAX_NAME = 200
"""Characters of a file's name that are shown [-]."""


@dataclass(frozen=True)
class Upload:
    """A file that was uploaded completely."""

    id: str
    name: str
    """Name on the user's computer; it is shown and never used as a path."""
    path: Path
    size: int
    """Size [bytes]."""


@dataclass
class Uploads:
    """The uploaded files of one run of the server, and the limits on them."""

    folder: Path
    max_file_bytes: int = 500 * MEGABYTE
    """Largest file [bytes]."""
    max_total_bytes: int = 2000 * MEGABYTE
    """All files together [bytes]."""
    max_files: int = 5000
    """Number of files [-]."""
    files: dict[str, Upload] = field(default_factory=dict)
    _numbers: Iterator[int] = field(default_factory=lambda: count(1))
    _arriving: dict[str, int] = field(default_factory=dict)
    """Bytes that have arrived of each unfinished upload."""

    @property
    def total_bytes(self) -> int:
        """Size of all files, the unfinished ones included [bytes]."""
        return sum(one.size for one in self.files.values()) + sum(self._arriving.values())

    async def receive(self, request: Request, name: str) -> Upload:
        """Store the body of a request. Nothing is left of one that is cut off or too large.

        Raises
        ------
        HTTPException
            413 when a limit is exceeded, 400 when the body is cut off or empty, 507 when the disk is full.
        """
        if len(self.files) + len(self._arriving) >= self.max_files:
            raise HTTPException(413, f"At most {self.max_files} files can be uploaded. Pack them into a zip archive.")
        identity = str(next(self._numbers))
        draft, path = self.folder / f"{identity}.part", self.folder / identity
        self._arriving[identity] = 0
        try:
            with draft.open("xb") as file:
                async for chunk in request.stream():
                    self._arriving[identity] += len(chunk)
                    self._check_size(name, self._arriving[identity])
                    file.write(chunk)
            size = self._arriving[identity]
            if size == 0:
                raise HTTPException(400, f"{name} is empty. Export the loop again.")
            draft.replace(path)
        except ClientDisconnect:
            raise HTTPException(400, f"The upload of {name} was cut off. Send it again.") from None
        except OSError as error:
            raise HTTPException(507, f"{name} cannot be stored ({error.strerror}). Free some space.") from None
        finally:
            del self._arriving[identity]
            with contextlib.suppress(OSError):
                draft.unlink(missing_ok=True)
        upload = self.files[identity] = Upload(identity, name, path, size)
        return upload

    def _check_size(self, name: str, size: int) -> None:
        if size > self.max_file_bytes:
            limit = self.max_file_bytes // MEGABYTE
            raise HTTPException(
                413, f"{name} is larger than {limit} MB. Start the server with it: stiction serve FILE."
            )
        if self.total_bytes > self.max_total_bytes:
            limit = self.max_total_bytes // MEGABYTE
            raise HTTPException(
                413, f"The files are larger than {limit} MB together. Remove some, or use stiction audit."
            )

    def remove(self, identity: str) -> None:
        """Delete a file."""
        upload = self.files.pop(identity, None)
        if upload is not None:
            upload.path.unlink(missing_ok=True)

    def find(self, identity: str) -> Upload:
        """Return a file by its id.

        Raises
        ------
        HTTPException
            404 when there is none.
        """
        if identity not in self.files:
            raise HTTPException(404, "This file is no longer available. Upload it again.")
        return self.files[identity]


def shown_name(text: str) -> str:
    """Return the name of a file on one line, without its folders' marks that could hide what it is.

    Examples
    --------
    >>> shown_name("../../etc/trend.csv"), shown_name("")
    ('etc/trend.csv', 'file')
    """
    parts = [part for part in text.replace("\\", "/").split("/") if part not in ("", ".", "..")]
    name = "".join(letter for letter in "/".join(parts) if letter.isprintable())
    return name[-MAX_NAME:] or "file"


async def _put(request: Request) -> Response:
    uploads: Uploads = request.app.state.workspace.uploads
    upload = await uploads.receive(request, shown_name(request.query_params.get("name", "")))
    return JSONResponse({"id": upload.id, "name": upload.name, "size": upload.size}, 201)


async def _delete(request: Request) -> Response:
    request.app.state.workspace.uploads.remove(request.path_params["file"])
    return Response(status_code=204)


ROUTES = [
    Route("/api/files", _put, methods=["PUT"]),
    Route("/api/files/{file}", _delete, methods=["DELETE"]),
]
