"""Refuse sentences that need a second reading, in what ships, in the contract and the documents.

python docs/check_prose.py [FILE...]: prints a line for each fault, and exits 1 if there is one. It
reads docstrings, comments and texts of Python files, and the sentences of other files.
"""

import ast
import io
import re
import sys
import tokenize
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PLACES = ("service", "model_export", "clients/python", "clients/blender", "api/openapi.yaml")
DOCUMENTS = ("*.md", "docs/**/*.md", "clients/*/README.md")
# A change log keeps the words of its time.
RECORDS = {"CHANGELOG.md"}
GENERATED = "generated.py"
# Words that stand for a noun which the sentence does not name.
CRUTCHES = re.compile(
    r"\b(nobody|somebody|whoever|hangs? on|held to|asked of|come by|of which there|by (so|as) much"
    r"|is no [a-z]+s?\.|nobody's|somebody's)\b",
    re.IGNORECASE,
)
OPENING = re.compile(r"(What|Who|How|Whether|Where|Whoever|Nobody|Somebody)\b")
# From Python 3.12 the texts of f-strings are tokens of their own.
SPOKEN = {tokenize.COMMENT, tokenize.STRING, getattr(tokenize, "FSTRING_MIDDLE", tokenize.STRING)}
DEFINITIONS = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


def main() -> None:
    """Check the files of the command line, or all that ships."""
    files = [Path(word) for word in sys.argv[1:]] or sorted(shipped())
    found = [fault for file in files for fault in faults(file)]
    print("\n".join(found) or f"{len(files)} files in plain words")
    sys.exit(bool(found))


def shipped() -> Iterator[Path]:
    """Yield the files that users and contributors read, except generated ones."""
    for place in PLACES:
        path = ROOT / place
        files = path.rglob("*.py") if path.is_dir() else [path]
        yield from (
            file for file in files if file.name != GENERATED and "node_modules" not in file.parts
        )
    for pattern in DOCUMENTS:
        found = ROOT.glob(pattern)
        yield from (file for file in found if RECORDS.isdisjoint(file.relative_to(ROOT).parts))


def faults(file: Path) -> Iterator[str]:
    """Yield a line for each fault in a file."""
    text = file.read_text(encoding="utf-8")
    spoken = python_text(text) if file.suffix == ".py" else enumerate(text.splitlines(), 1)
    for line, sentence in spoken:
        for crutch in CRUTCHES.finditer(sentence):
            yield f"{file}:{line}: {crutch[0]!r} in: {sentence.strip()[:100]}"
    if file.suffix == ".py":
        for line, first in openings(text):
            yield f"{file}:{line}: a docstring begins with {first!r}, expected a verb or a noun"


def python_text(text: str) -> Iterator[tuple[int, str]]:
    """Yield the comments and strings of a module, line by line; names are no prose."""
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type in SPOKEN and " " in token.string:
            for number, line in enumerate(token.string.splitlines(), token.start[0]):
                # Expressions of f-strings are code.
                yield number, re.sub(r"\{[^{}]*\}", "", line)


def openings(text: str) -> Iterator[tuple[int, str]]:
    """Yield the first word of docstrings that begin with a question."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, DEFINITIONS) and (
            found := OPENING.match(ast.get_docstring(node) or "")
        ):
            yield getattr(node, "lineno", 1), found[0]


if __name__ == "__main__":
    main()
