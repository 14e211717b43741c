# SPDX-License-Identifier: Apache-2.0
"""What is proved: tests/proof/<group>.toml describes the functions proof_<name>() of tests/proof/<group>.c."""

import re
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from fluxtrue_tools.errors import FluxtrueError

FOLDER: Final = Path("tests", "proof")
FIRMWARE: Final = Path("firmware")
REQUIRED: Final = {"name", "property", "ranges", "planted"}
OPTIONAL: Final = {"unwind", "options", "long"}
_HARNESS: Final = re.compile(r"^void proof_(\w+)\(void\)$", re.MULTILINE)


@dataclass(frozen=True)
class Planted:
    """An error in the firmware that the harness must find: one text of a file replaced by another."""

    file: Path  # below firmware/
    old: str
    new: str

    def apply(self, root: Path) -> str:
        """The file's text with the error."""
        path = root / FIRMWARE / self.file
        if not path.is_file():
            raise FluxtrueError(f"planted error in {self.file}: there is no such file below {FIRMWARE}")
        text = path.read_text(encoding="utf-8")
        if text.count(self.old) != 1:
            raise FluxtrueError(
                f"planted error in {self.file}: {self.old!r} occurs {text.count(self.old)} times, not once"
            )
        return text.replace(self.old, self.new)


@dataclass(frozen=True)
class Proof:
    """One harness."""

    name: str
    group: str
    statement: str  # the property
    ranges: str
    planted: Planted
    options: tuple[str, ...]
    long: bool  # left out unless asked for

    @property
    def source(self) -> Path:
        """The file with the harness."""
        return FOLDER / f"{self.group}.c"


def _proof(group: str, row: dict[str, Any], where: Path) -> Proof:
    name = row.get("name", "?")
    unknown, missing = set(row) - REQUIRED - OPTIONAL, REQUIRED - set(row)
    if unknown or missing:
        raise FluxtrueError(f"{where}: proof {name}: unknown keys {sorted(unknown)}, missing keys {sorted(missing)}")
    planted = row["planted"]
    if set(planted) != {"file", "old", "new"}:
        raise FluxtrueError(f"{where}: proof {name}: planted = {{file, old, new}} wanted")
    options = tuple(row.get("options", ())) + (("--unwind", str(row["unwind"])) if "unwind" in row else ())
    error = Planted(Path(planted["file"]), planted["old"], planted["new"])
    return Proof(name, group, row["property"], row["ranges"], error, options, row.get("long", False))


def load(root: Path) -> list[Proof]:
    """All proofs, in the order of the files; every harness of a source has its description and the other way round."""
    proofs: list[Proof] = []
    for path in sorted((root / FOLDER).glob("*.toml")):
        rows = tomllib.loads(path.read_text(encoding="utf-8")).get("proof", [])
        described = [_proof(path.stem, row, path.relative_to(root)) for row in rows]
        written = _HARNESS.findall(path.with_suffix(".c").read_text(encoding="utf-8"))
        if [proof.name for proof in described] != written:
            differing = sorted({proof.name for proof in described} ^ set(written)) or "their order"
            raise FluxtrueError(f"{path.relative_to(root)} and {path.stem}.c differ: {differing}")
        proofs += described
    names = [proof.name for proof in proofs]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise FluxtrueError(f"{FOLDER}: proofs of the same name: {twice}")
    return proofs
