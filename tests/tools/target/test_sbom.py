# SPDX-License-Identifier: Apache-2.0
"""The software bill of materials lists every file of the firmware and every pinned package in the form of SPDX 2.3."""

import hashlib
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from fluxtrue_tools.version import version

ROOT = Path(__file__).resolve().parents[3]


def sbom(out: Path, epoch: str = "1700000000") -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"PYTHONPATH": str(ROOT / "tools"), "SOURCE_DATE_EPOCH": epoch}
    command = [sys.executable, "-m", "fluxtrue_tools", "target", "sbom", "--out", str(out)]
    return subprocess.run(command, capture_output=True, text=True, env=environment, check=False)


@pytest.fixture(scope="module")
def bill(tmp_path_factory: pytest.TempPathFactory) -> Any:
    out = tmp_path_factory.mktemp("sbom") / "fluxtrue.spdx.json"
    done = sbom(out)
    assert done.returncode == 0, done.stderr
    return json.loads(out.read_text(encoding="utf-8"))


def test_it_has_what_a_document_must_have(bill: Any) -> None:
    assert bill["spdxVersion"] == "SPDX-2.3"
    assert bill["creationInfo"]["created"] == "2023-11-14T22:13:20Z"
    firmware = next(package for package in bill["packages"] if package["name"] == "fluxtrue")
    assert (firmware["versionInfo"], firmware["licenseDeclared"]) == (version(), "Apache-2.0")
    ids = [each["SPDXID"] for each in (*bill["packages"], *bill["files"])]
    assert len(set(ids)) == len(ids)
    assert all(re.fullmatch(r"SPDXRef-[A-Za-z0-9.-]+", each) for each in ids)
    assert {r["relatedSpdxElement"] for r in bill["relationships"]} <= set(ids)


def test_every_source_file_of_the_firmware_is_in_it_with_its_checksum(bill: Any) -> None:
    named = {file["fileName"]: file["checksums"][1]["checksumValue"] for file in bill["files"]}
    sources = [*(ROOT / "firmware").rglob("*.[ch]"), *(ROOT / "hal").rglob("*.[ch]")]
    assert sources
    for path in sources:
        assert named[f"./{path.relative_to(ROOT)}"] == hashlib.sha256(path.read_bytes()).hexdigest()


def test_every_pinned_package_is_in_it(bill: Any) -> None:
    pinned = [line for line in (ROOT / "tools" / "requirements.txt").read_text().splitlines() if "==" in line]
    found = {f"{package['name']}=={package['versionInfo']}" for package in bill["packages"]}
    assert {line.split(";")[0].strip() for line in pinned} <= found


def test_a_time_that_is_none_is_refused(tmp_path: Path) -> None:
    done = sbom(tmp_path / "x.json", "yesterday")
    assert done.returncode == 2
    assert "SOURCE_DATE_EPOCH = 'yesterday', allowed: whole seconds since 1970" in done.stderr
    assert not (tmp_path / "x.json").exists()
