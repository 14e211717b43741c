# SPDX-License-Identifier: Apache-2.0
"""Files of the wizard: the pictures of each result, and the motor's folder."""

import asyncio
from typing import TYPE_CHECKING, Final

from aiohttp import web

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.live.session import SESSION

if TYPE_CHECKING:
    from fluxtrue_tools.live.wizard.wizard import Wizard

FINISH: Final = "finish"
# What the pictures of each card show, for commission/plot.py.
PICTURES: Final = {
    "offsets": ("Currents that the sensors show without current",),
    "phases": (),
    "spin": (),
    "drag": ("Torque against the rotation over the speed",),
    "resistance": ("Mean voltages over mean currents, with the slope of the resistance",),
    "map": ("Currents of all bursts in the circle of the largest current", "What the surface leaves of the samples",
            "Flux linkage of the d axis: samples on the surface", "Flux linkage of the q axis: samples on the surface"),
    FINISH: ("Torque of the map over the currents, with the line of largest torque per ampere",),
}  # fmt: skip
THEMES: Final = ("light", "dark")


def _wizard(request: web.Request) -> "Wizard":
    wizard = request.app[SESSION].wizard
    if wizard is None:
        raise web.HTTPNotFound(text="no motor is measured here")
    return wizard


def _drawn(wizard: "Wizard", step: str, panel: int, theme: str) -> bytes:
    from fluxtrue_tools.commission import plot  # matplotlib: only when it is needed

    if step == FINISH:
        folder = wizard.folder
        if folder is None or folder.grid is None:
            raise FluxtrueError("the motor's folder has not been written")
        return plot.of_torque(folder.found, folder.grid, folder.known, theme)
    found, known, _ = wizard.result(step)
    return plot.of_step(step, panel, found, known, theme)


async def picture(request: web.Request) -> web.Response:
    """One panel of a result."""
    wizard, step, panel = _wizard(request), request.match_info["step"], int(request.match_info["panel"])
    theme = request.query.get("theme", "light")
    if theme not in THEMES or panel >= len(PICTURES.get(step, ())):
        raise web.HTTPNotFound(text="no such picture")
    try:
        body = await asyncio.get_running_loop().run_in_executor(wizard.thread, _drawn, wizard, step, panel, theme)
    except FluxtrueError as error:
        raise web.HTTPNotFound(text=str(error)) from error
    return web.Response(body=body, content_type="image/png")


async def folder_file(request: web.Request) -> web.Response:
    """The motor's folder as a .zip."""
    folder = _wizard(request).folder
    if folder is None:
        raise web.HTTPNotFound(text="the motor's folder has not been written")
    return web.Response(body=folder.archive, content_type="application/zip",
                        headers={"Content-Disposition": f'attachment; filename="{folder.name}.zip"'})  # fmt: skip
