"""Checks of the contract by Redocly, which must also detect deliberate errors."""

import json
import os
import subprocess
import tempfile
from pathlib import Path

import environment

CONTRACT = environment.ROOT / "api" / "openapi.yaml"
QUIET = {"REDOCLY_TELEMETRY": "off", "REDOCLY_SUPPRESS_UPDATE_NOTICE": "true"}

# What is taken out of the contract, and the rule that sees it.
BREAKS = {
    "summary: List the models": "operation-summary",
    "Link: {$ref: '#/components/headers/Help'}": "response-contains-header",
    "description: Model name, or name@hash.": "parameter-description",
    "license: {name: Apache-2.0, identifier: Apache-2.0}": "info-license",
    "operationId: getModel": "operation-operationId",
}


def faults(node: Path) -> list[str]:
    """Return the faults of the contract and of its linter, a line each."""
    found = [f"contract: {rule} at {place}" for rule, place in _found(node, CONTRACT)]
    return found + [f"contract: {rule} is not seen" for rule in _unseen(node)]


def _unseen(node: Path) -> list[str]:
    text = CONTRACT.read_text()
    with tempfile.TemporaryDirectory() as name:
        broken, unseen = Path(name) / "openapi.yaml", []
        for line, rule in BREAKS.items():
            broken.write_text(text.replace(line, "", 1))
            if text.count(line) == 0 or rule not in dict(_found(node, broken)):
                unseen.append(rule)
    return unseen


def _found(node: Path, contract: Path) -> list[tuple[str, str]]:
    """Rules that a contract breaks, and where."""
    program = environment.THREE / "node_modules" / "@redocly" / "cli" / "bin" / "cli.js"
    command = [node, program, "lint", contract, "--config", environment.ROOT / "redocly.yaml"]
    done = subprocess.run(
        [*command, "--format", "json"],
        capture_output=True,
        text=True,
        cwd=environment.ROOT,
        env=os.environ | QUIET,
    )
    problems = json.loads(done.stdout[done.stdout.index("{") :])["problems"]
    counted = [each for each in problems if not each.get("ignored")]
    return [(each["ruleId"], each["location"][0].get("pointer", "")) for each in counted]
