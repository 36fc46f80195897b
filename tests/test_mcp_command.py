"""Tests of `posefield mcp`: a process, asked over MCP by the client of the SDK."""

import asyncio
import json
import os
import subprocess
import sys

import pytest
from mcp import Client, StdioServerParameters
from mcp.client.stdio import stdio_client

from posefield.http.api import contract

pytestmark = pytest.mark.system

WALK = {"segments": [{"kind": "walk", "model": "walk", "seconds": 1.5}]}


@pytest.fixture
def with_client(models, tmp_path):
    """Function that runs a coroutine with a client of a process, which writes to a folder."""
    words = ["-m", "posefield", "mcp", str(models), "-o", str(tmp_path)]
    started = StdioServerParameters(command=sys.executable, args=words, env=dict(os.environ))

    def run(talk):
        async def whole():
            async with Client(stdio_client(started), read_timeout_seconds=60) as client:
                return await talk(client)

        return asyncio.run(whole())

    return run


def test_tools_are_listed_with_the_schemas_of_the_contract(with_client):
    async def talk(client):
        return await client.list_tools()

    found = {tool.name: tool for tool in with_client(talk).tools}
    assert list(found) == ["list_models", "plan_performance", "perform"]
    script = contract.schema("PerformanceQuestion")
    assert found["plan_performance"].input_schema["properties"] == {"script": script}
    assert set(found["perform"].input_schema["required"]) == {"script", "file"}
    assert [tool.annotations.read_only_hint for tool in found.values()] == [True, True, False]
    assert all(tool.description and tool.output_schema for tool in found.values())


def test_an_agent_looks_plans_and_performs(with_client, tmp_path):
    async def talk(client):
        listed = await client.call_tool("list_models")
        planned = await client.call_tool("plan_performance", {"script": WALK})
        asked = {"script": WALK, "file": "walk.glb"}
        return listed, planned, await client.call_tool("perform", asked)

    listed, planned, made = with_client(talk)
    names = [each["name"] for each in listed.structured_content["models"]]
    # The shipped models are there too.
    assert {"walk", "reach", "cmu_walk"} <= set(names)
    assert planned.structured_content["duration"] == made.structured_content["duration"] == 1.5
    assert made.structured_content["file"] == str(tmp_path / "walk.glb")
    assert json.loads(made.content[0].text) == made.structured_content
    assert (tmp_path / "walk.glb").read_bytes().startswith(b"glTF")


def test_errors_are_for_the_agent_and_the_server_goes_on(with_client, tmp_path):
    async def talk(client):
        wrong = {"segments": [*WALK["segments"], {"kind": "act", "model": "reech"}]}
        refused = await client.call_tool("perform", {"script": wrong, "file": "a.usdc"})
        unknown = await client.call_tool("dance", {})
        again = await client.call_tool("plan_performance", {"script": WALK})
        return refused, unknown, again

    refused, unknown, again = with_client(talk)
    assert refused.is_error and unknown.is_error and not again.is_error
    assert refused.content[0].text.startswith("/script/segments/1/model: no model 'reech' (did you")
    assert unknown.content[0].text.startswith("no tool 'dance', expected one of list_models")
    assert list(tmp_path.iterdir()) == []


def test_nothing_but_messages_is_written_to_standard_output(models):
    """The process ends by itself, in silence, where standard input ends."""
    words = [sys.executable, "-m", "posefield", "mcp", str(models)]
    done = subprocess.run(words, input=b"", capture_output=True, timeout=60)
    assert (done.returncode, done.stdout, done.stderr) == (0, b"", b"")


def test_the_schema_of_scripts_is_printed(posefield):
    code, said, _ = posefield("mcp", "--schema")
    assert code == 0 and json.loads(said) == contract.script_schema()


def test_a_folder_that_is_not_there_is_named(posefield, tmp_path):
    code, _, told = posefield("mcp", "-o", tmp_path / "gone")
    assert code == 3 and "gone: no folder, expected one to write files to" in told
