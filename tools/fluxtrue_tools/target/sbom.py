# SPDX-License-Identifier: Apache-2.0
"""The software bill of materials: the firmware's files with their checksums, and the packages that build and test it.

Source   SPDX Specification 2.3, JSON
"""

import hashlib
import re
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from fluxtrue_tools.version import version

FOLDERS: Final = ("firmware", "hal")
SUFFIXES: Final = (".c", ".h", ".dbc", ".S", ".ld")
PINNED: Final = re.compile(r"([\w.-]+)==([\w.]+)")
LICENCE: Final = "Apache-2.0"


def _id(*parts: str) -> str:
    """Letters, digits, full stop and hyphen only."""
    return "SPDXRef-" + "-".join(re.sub(r"[^A-Za-z0-9.]+", "-", part) for part in parts)


def _files(root: Path) -> Iterator[dict[str, Any]]:
    paths = (path for folder in FOLDERS for path in sorted((root / folder).rglob("*")))
    for path in paths:
        if path.suffix in SUFFIXES and path.is_file():
            name, data = str(path.relative_to(root)), path.read_bytes()
            sums = [{"algorithm": kind, "checksumValue": hashlib.new(kind.lower(), data).hexdigest()}
                    for kind in ("SHA1", "SHA256")]  # fmt: skip
            yield {
                "SPDXID": _id("File", name), "fileName": f"./{name}", "checksums": sums, "licenseConcluded": LICENCE,
                "licenseInfoInFiles": [LICENCE], "copyrightText": "NOASSERTION",
            }  # fmt: skip


def _verification(files: list[dict[str, Any]]) -> str:
    """Of the package: SHA-1 of the sorted SHA-1 sums of its files."""
    sums = sorted(file["checksums"][0]["checksumValue"] for file in files)
    return hashlib.sha1("".join(sums).encode()).hexdigest()


def _package(name: str, number: str, **more: Any) -> dict[str, Any]:
    return {
        "SPDXID": _id("Package", name), "name": name, "versionInfo": number, "downloadLocation": "NOASSERTION",
        "licenseConcluded": "NOASSERTION", "licenseDeclared": "NOASSERTION", "copyrightText": "NOASSERTION",
        "filesAnalyzed": False, **more,
    }  # fmt: skip


def _python(root: Path) -> Iterator[dict[str, Any]]:
    """The environment of tools, tests and the generators of code."""
    for line in (root / "tools" / "requirements.txt").read_text(encoding="utf-8").splitlines():
        if match := PINNED.fullmatch(line.split(";")[0].strip()):
            locator = f"pkg:pypi/{match[1].lower()}@{match[2]}"
            reference = {"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl", "referenceLocator": locator}
            yield _package(match[1], match[2], externalRefs=[reference])


def document(root: Path, created_s: int) -> dict[str, Any]:
    """The whole, the same for the same files and time."""
    files, tools = list(_files(root)), list(_python(root))
    firmware = _package("fluxtrue", version(), filesAnalyzed=True, licenseConcluded=LICENCE, licenseDeclared=LICENCE,
                        licenseInfoFromFiles=[LICENCE],
                        packageVerificationCode={"packageVerificationCodeValue": _verification(files)})  # fmt: skip
    own = firmware["SPDXID"]
    contains = [{"spdxElementId": own, "relationshipType": "CONTAINS", "relatedSpdxElement": file["SPDXID"]}
                for file in files]  # fmt: skip
    builds = [{"spdxElementId": tool["SPDXID"], "relationshipType": "DEV_TOOL_OF", "relatedSpdxElement": own}
              for tool in tools]  # fmt: skip
    describes = {"spdxElementId": "SPDXRef-DOCUMENT", "relationshipType": "DESCRIBES", "relatedSpdxElement": own}
    return {
        "spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT",
        "name": f"fluxtrue-{version()}",
        "documentNamespace": f"https://spdx.org/spdxdocs/fluxtrue-{version()}-{_verification(files)}",
        "creationInfo": {"created": datetime.fromtimestamp(created_s, UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
                         "creators": ["Tool: fluxtrue target sbom"]},
        "packages": [firmware, *tools], "files": files, "relationships": [describes, *contains, *builds],
    }  # fmt: skip
