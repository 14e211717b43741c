# SPDX-License-Identifier: Apache-2.0
"""Files that the page offers for download: the newest capture of the oscilloscope."""

import asyncio
import tempfile
from pathlib import Path
from typing import Final

from aiohttp import web

from fluxtrue_tools.live.session import SESSION
from fluxtrue_tools.scope.scope import Capture

TYPES: Final = {"csv": "text/csv", "mf4": "application/octet-stream"}


def _written(capture: Capture, kind: str) -> bytes:
    from fluxtrue_tools.scope import export  # matplotlib: only when it is needed

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"capture.{kind}"
        {"csv": export.write_csv, "mf4": export.write_mdf}[kind](capture, path)
        return path.read_bytes()


async def capture_file(request: web.Request) -> web.Response:
    """The newest capture as CSV or MDF4."""
    oscilloscope, kind = request.app[SESSION].oscilloscope, request.match_info["kind"]
    if oscilloscope is None or oscilloscope.newest is None:
        raise web.HTTPNotFound(text="no capture has been read")
    number, capture = oscilloscope.newest
    if request.query.get("number", str(number)) != str(number):
        raise web.HTTPNotFound(text=f"capture {number} is newer, and only the newest is kept")
    body = await asyncio.to_thread(_written, capture, kind)
    name = f"capture-{number}.{kind}"
    return web.Response(body=body, content_type=TYPES[kind],
                        headers={"Content-Disposition": f'attachment; filename="{name}"'})  # fmt: skip
