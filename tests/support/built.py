# SPDX-License-Identifier: Apache-2.0
"""The simulation library of a motor's folder that the build does not know: like that of another motor, with its tables.

The commands are those by which the build has made the other motor's library; only the generated tables are another's.
"""

import re
import subprocess
from pathlib import Path

from fluxtrue_tools.cli import run as command


def simulation_like(build: Path, motor: str, folder: Path, place: Path) -> Path:
    """Generate the tables of `folder` and link them in place of those of `motor`; the library's folder."""
    place.mkdir()
    assert command(["motor", "build", str(folder), "--out", str(place), "--no-report"]) == 0
    library = f"motors/{motor}/libfluxtrue_sim.so"
    listed = subprocess.run(["ninja", "-C", str(build), "-t", "commands", library], capture_output=True, text=True,
                            check=True).stdout.splitlines()  # fmt: skip
    tables = [line for line in listed if re.search(rf"motors/{motor}/motor_(tables|si)\.c\b", line) and " -c " in line]
    assert len(tables) == 2
    link = listed[-1]
    for line in tables:
        source, old = line.rpartition(" -c ")[2], re.search(r" -o (\S+)", line)
        assert old is not None
        name = Path(source).name
        made = place / f"{name}.o"
        subprocess.run(line.replace(source, str(place / name)).replace(f"-o {old[1]} ", f"-o {made} "), shell=True,
                       cwd=build, check=True)  # fmt: skip
        assert old[1] in link
        link = link.replace(old[1], str(made))
    subprocess.run(link.replace(f"-o {library}", f"-o {place / Path(library).name}"), shell=True, cwd=build, check=True)
    return place
