"""Tests of the help: groups, examples, placeholders, and completion."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import typer

from posefield import cli
from posefield_train.cli import command_evaluate, commands

commands(cli.app)
GROUP = typer.main.get_command(cli.app)
NAMES = sorted(GROUP.commands)
WIDTH = 80


@pytest.fixture
def helped(posefield, monkeypatch):
    """Function that returns the help of a command on a terminal of 80 columns."""
    monkeypatch.setenv("COLUMNS", str(WIDTH))

    def of(*words):
        code, out, err = posefield(*words)
        assert (code, err) == (0, "")
        return out

    return of


def test_without_arguments_it_helps_and_succeeds(helped):
    assert helped() == helped("-h") == helped("--help")


@pytest.mark.parametrize("name", NAMES)
def test_every_help_has_examples_that_parse_and_no_python_types(helped, name):
    text = helped(name, "-h")
    assert text == helped(name, "--help")
    assert re.search(rf"Examples:\s+posefield {name} ", text)
    assert not re.search(r"<(bool|int|float|str|path|list.*)>", text)
    usage = next(line for line in text.splitlines() if "Usage:" in line)
    assert re.search(r"\{[a-z]", usage) is None, usage
    # Each example parses: its options and the number of its arguments are the command's.
    command = GROUP.commands[name]
    known = {opt for param in command.params for opt in param.opts}
    for line in re.findall(rf"posefield {name} (.*)", command.epilog):
        words = re.sub(r" (>>|<) .*", "", line).split()
        assert {word.partition("=")[0] for word in words if re.match("-[a-z-]", word)} <= known
        command.make_context(name, list(words), resilient_parsing=True)


@pytest.mark.parametrize(
    ("words", "parsed"),
    [
        (["a.toml", "--json", "b.json"], ["a.toml", "--json-file", "b.json"]),
        (["--json", "a.toml"], ["--json", "a.toml"]),
        (["a.toml", "--json"], ["a.toml", "--json"]),
        (["a.toml", "--json", "--protocol", "clip"], ["a.toml", "--json", "--protocol", "clip"]),
    ],
)
def test_evaluate_takes_json_as_a_flag_and_with_a_file_as_before(words, parsed):
    assert command_evaluate.json_file_words(words) == parsed


def test_an_unknown_command_suggests_one(posefield):
    code, _, err = posefield("clipp")
    assert code == 2 and "Did you mean 'clip'?" in err


@pytest.mark.system
@pytest.mark.parametrize(
    ("line", "word"), [("posefield cl", "clip"), ("posefield clip --fe", "--feet")]
)
def test_shells_complete_commands_and_options(line, word):
    asked = {"_POSEFIELD_COMPLETE": "complete_bash", "COMP_WORDS": line}
    asked["COMP_CWORD"] = str(line.count(" "))
    command = Path(sys.executable).parent / "posefield"
    done = subprocess.run([command], capture_output=True, text=True, env=os.environ | asked)
    assert word in done.stdout.split()


def test_commands_start_without_the_packages_that_few_need():
    """Negative control: NumPy, which all need, is there."""
    code = (
        "import sys; from posefield import cli; from posefield_train.cli import commands; "
        "commands(cli.app); print(*sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = set(done.stdout.split())
    assert "numpy" in loaded
    assert loaded.isdisjoint({"rich.progress", "scipy", "onnx", "pydantic", "starlette", "pxr"})
