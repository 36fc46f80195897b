"""Refuse sentences that need a second reading, in what ships, in the contract and the documents.

python docs/check_prose.py [FILE...]: prints a line for each fault, and exits 1 if there is one. It
reads docstrings, comments and texts of Python files, comments of TypeScript, and the sentences of
other files.
"""

import ast
import io
import re
import sys
import tokenize
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PLACES = ("service", "model_export", "clients", "api/openapi.yaml")
SOURCES = {".py", ".ts"}
DOCUMENTS = ("*.md", "docs/**/*.md", "clients/*/README.md")
# A change log keeps the words of its time.
RECORDS = {"CHANGELOG.md"}
GENERATED = {"generated.py", "schema.ts"}
FOREIGN = {"node_modules", "dist", "build"}
# Words that stand for a noun which the sentence does not name.
CRUTCHES = re.compile(
    r"\b(nobody|somebody|whoever|hangs? on|held to|asked of|come by|of which there|by (so|as) much"
    r"|is no [a-z]+s?\.|nobody's|somebody's)\b",
    re.IGNORECASE,
)
OPENING = re.compile(r"(What|Which|Who|How|Whether|Where|Whoever|Nobody|Somebody)\b")
# Of TypeScript: a doc comment, or one to the end of a line.
COMMENT = re.compile(r"/\*\*(.*?)\*/|(?<=[\s;])//(.*?)$", re.DOTALL | re.MULTILINE)
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
        files = sorted(path.rglob("*.*")) if path.is_dir() else [path]
        for file in files:
            ours = file.name not in GENERATED and FOREIGN.isdisjoint(file.relative_to(ROOT).parts)
            if ours and (file == path or file.suffix in SOURCES):
                yield file
    for pattern in DOCUMENTS:
        found = ROOT.glob(pattern)
        yield from (file for file in found if RECORDS.isdisjoint(file.relative_to(ROOT).parts))


def faults(file: Path) -> Iterator[str]:
    """Yield a line for each fault in a file."""
    text = file.read_text(encoding="utf-8")
    read = {".py": python_text, ".ts": typescript_text}.get(file.suffix)
    spoken = read(text) if read else enumerate(text.splitlines(), 1)
    for line, sentence in spoken:
        for crutch in CRUTCHES.finditer(sentence):
            yield f"{file}:{line}: {crutch[0]!r} in: {sentence.strip()[:100]}"
    if read:
        for line, first in openings(text) if file.suffix == ".py" else comment_openings(text):
            yield f"{file}:{line}: begins with {first!r}, expected a verb or a noun"


def python_text(text: str) -> Iterator[tuple[int, str]]:
    """Yield the comments and strings of a module, line by line; names are no prose."""
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type in SPOKEN and " " in token.string:
            for number, line in enumerate(token.string.splitlines(), token.start[0]):
                # Expressions of f-strings are code.
                yield number, re.sub(r"\{[^{}]*\}", "", line)


def typescript_text(text: str) -> Iterator[tuple[int, str]]:
    """Yield the comments of a module, line by line."""
    for comment in COMMENT.finditer(text):
        first = text.count("\n", 0, comment.start()) + 1
        yield from enumerate(comment[0].splitlines(), first)


def comment_openings(text: str) -> Iterator[tuple[int, str]]:
    """Yield the first word of comments that begin with a question."""
    for line, comment in typescript_text(text):
        opening = OPENING.match(comment.lstrip("/* "))
        if opening and comment.startswith("/"):
            yield line, opening[0]


def openings(text: str) -> Iterator[tuple[int, str]]:
    """Yield the first word of docstrings that begin with a question."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, DEFINITIONS) and (
            found := OPENING.match(ast.get_docstring(node) or "")
        ):
            yield getattr(node, "lineno", 1), found[0]


if __name__ == "__main__":
    main()
