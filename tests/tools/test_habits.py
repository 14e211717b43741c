# SPDX-License-Identifier: Apache-2.0
"""The pre-commit hooks and the workflow run programs of this checkout and download nothing from elsewhere."""

import os
import re
import subprocess
from pathlib import Path
from typing import Any

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
HOOKS = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8"))
WORKFLOW_TEXT = (ROOT / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8")
WORKFLOW = yaml.safe_load(WORKFLOW_TEXT)
STEPS = [step for job in WORKFLOW["jobs"].values() for step in job["steps"]]


def test_all_hooks_are_local() -> None:
    assert [repository["repo"] for repository in HOOKS["repos"]] == ["local"]


@pytest.mark.parametrize("hook", HOOKS["repos"][0]["hooks"], ids=lambda hook: hook["id"])
def test_a_hook_runs_what_exists(hook: dict[str, Any]) -> None:
    assert hook["language"] == "system"
    program, *arguments = hook["entry"].split()
    assert os.access(ROOT / program, os.X_OK), program
    assert all((ROOT / word).is_file() for word in arguments if "/" in word)


@pytest.mark.parametrize("hook", HOOKS["repos"][0]["hooks"], ids=lambda hook: hook["id"])
def test_a_hook_accepts_a_good_file_and_its_pattern_names_it(hook: dict[str, Any]) -> None:
    good = next(
        name for name in ("tools/checks/format.py", "hal/template/irq.c") if re.search(hook.get("files", ""), name)
    )
    names = [good] if hook.get("pass_filenames", True) else []
    done = subprocess.run([*hook["entry"].split(), *names], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_workflow_uses_the_official_checkout_only() -> None:
    assert {step["uses"].partition("@")[0] for step in STEPS if "uses" in step} == {"actions/checkout"}
    assert re.findall(r"\w+://\S+", WORKFLOW_TEXT) == []


def test_the_workflow_runs_the_whole_gate_and_posts_the_cost() -> None:
    commands = [step.get("run", "") for step in STEPS]
    assert ".ci/run" in commands
    assert os.access(ROOT / ".ci" / "run", os.X_OK)
    assert any("tools/performance_diff.py --base" in command for command in commands)
    assert os.access(ROOT / "tools" / "performance_diff.py", os.X_OK)


@pytest.mark.parametrize("step", [step for step in STEPS if "run" in step], ids=lambda step: step["name"])
def test_a_steps_commands_are_shell(step: dict[str, Any]) -> None:
    done = subprocess.run(["bash", "-n"], input=step["run"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_the_step_that_compares_writes_the_table_into_the_summary(tmp_path: Path) -> None:
    (step,) = (step for step in STEPS if "performance_diff" in step.get("run", ""))
    head = subprocess.run(["git", "rev-parse", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=False)
    if head.returncode != 0:
        pytest.skip("no git repository: nothing to compare with")
    summary = tmp_path / "summary.md"
    environment = {**os.environ, "BASE": head.stdout.strip(), "RUNNER_TEMP": str(tmp_path),
                   "GITHUB_STEP_SUMMARY": str(summary)}  # fmt: skip
    subprocess.run(["bash", "-e", "-o", "pipefail", "-c", step["run"]], cwd=ROOT, env=environment, check=True)
    assert re.match(r"### Cost of the firmware\n\n(No figure|\d+ of \d+ figures) of `docs/performance.json` ha",
                    summary.read_text(encoding="utf-8"))  # fmt: skip
