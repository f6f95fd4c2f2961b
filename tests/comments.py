#!/usr/bin/env python3
"""Finds sentences that begin with a relative clause that has no noun ("What of g is hidden."), in comments, docstrings,
texts that a user reads, and documents; a question may begin so. Fails where there is one.

usage: tests/comments.py [--count] [FILE|FOLDER...]     --count prints the number for each folder and does not fail; named
files that have no comments are passed over
"""
import ast
import collections
import io
import pathlib
import re
import subprocess
import sys
import tokenize

HERE = pathlib.Path(__file__).resolve().parent.parent
WORDS = r"(?:what|whatever|whether|who|whoever|whose|which|how|so much|so many|those (?:that|who|which|whose|of))\b"
BEGIN = re.compile(WORDS, re.I)
# Inside a text a sentence begins after a full stop, or after a colon by a capital letter.
LATER = re.compile(r"(?:[.!?][\")]?|:)\s+(%s)" % WORDS, re.I)
QUESTION = re.compile(r"[^.!?]*\?")
ESCAPES = {r"\n": "\n", r"\"": '"', r"\t": " "}
C_TOKEN = re.compile(r'/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\'', re.S)
HASH = re.compile(r"(?:^|(?<=\s))#(?!!)[ \t]?(.*)$")


def c_texts(source):
    """(line, text, is_comment) of comments and of string literals, adjacent ones joined."""
    literals, line, last = [], 1, 0
    for token in C_TOKEN.finditer(source):
        between = source[last:token.start()]
        if between.strip() and literals:
            yield literals[0][0], "".join(text for _, text in literals), False
            literals = []
        line += between.count("\n")
        text = token.group()
        if text.startswith("/*"):
            yield line, re.sub(r"\n[ \t]*\*? ?", "\n", text[2:-2]), True
        elif text.startswith("//"):
            yield line, text[2:], True
        elif text.startswith('"'):
            literals.append((line, re.sub(r'\\["nt]', lambda e: ESCAPES[e.group()], text[1:-1])))
        line += text.count("\n")
        last = token.end()


def hash_texts(lines):
    """(line, text, True) of comments that # begins, consecutive whole-line ones joined."""
    block, start = [], 0
    for number, line in enumerate(lines, 1):
        found = HASH.search(line)
        alone = found is not None and line[:found.start()].strip() == ""
        if block and not alone:
            yield start, "\n".join(block), True
            block = []
        if alone:
            start = start if block else number
            block.append(found.group(1))
        elif found is not None and line.count('"', 0, found.start()) % 2 == 0 and line.count("'", 0, found.start()) % 2 == 0:
            yield number, found.group(1), True
    if block:
        yield start, "\n".join(block), True


def python_texts(source):
    """Comments by the tokens, docstrings and other texts by the tree."""
    lines = [""] * source.count("\n") + [""]
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            before = token.line[:token.start[1]]
            lines[token.start[0] - 1] = token.string if not before.strip() else "x " + token.string
    yield from hash_texts(lines)
    tree = ast.parse(source)
    docstrings = {id(node.body[0].value) for node in ast.walk(tree)
                  if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef)) and ast.get_docstring(node) is not None}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.lineno, node.value.strip(), id(node) in docstrings


def document_texts(source):
    """The paragraphs, list items and table cells of a Markdown file, without headings and blocks of code."""
    source = re.sub(r"^```.*?^```", lambda block: "\n" * block.group().count("\n"), source, flags=re.S | re.M)
    paragraph, start = [], 0
    for number, line in enumerate(source.split("\n") + [""], 1):
        item = re.match(r"\s*(?:[-*]|\d+\.)\s+(.*)", line)
        ends = not line.strip() or item or line.startswith(("#", "|"))
        if paragraph and ends:
            yield start, "\n".join(paragraph), False
            paragraph = []
        if line.startswith("#") or not line.strip():
            continue
        start = start if paragraph else number
        paragraph.append(item.group(1) if item else line)
    if paragraph:
        yield start, "\n".join(paragraph), False


def texts_of(path):
    source = path.read_text(encoding="utf-8")
    if path.suffix in (".c", ".h", ".inc"):
        return c_texts(source)
    if path.suffix == ".py":
        return python_texts(source)
    if path.suffix == ".md":
        return document_texts(source)
    return hash_texts(source.split("\n"))


def fragments(text, is_comment):
    """Offsets of the sentences of a text that begin so; a comment may begin with a small letter, a text may not."""
    body = len(text) - len(text.lstrip())
    found = BEGIN.match(text, body)
    joined = re.compile("which|whose").match(text, body)  # a clause of the line of code before it
    offsets = [body] if found and not joined and (is_comment or text[body].isupper()) else []
    offsets += [at.start(1) for at in LATER.finditer(text) if at.group(1)[0].isupper()]
    return [at for at in offsets if not QUESTION.match(text, at)]


def checked_files(arguments):
    listed = subprocess.run(["git", "ls-files", "-co", "--exclude-standard", "--"] + arguments, cwd=HERE, check=True,
                            capture_output=True, text=True).stdout.split("\n")
    for name in listed:
        path = HERE / name
        if path.is_file() and (path.suffix in (".c", ".h", ".inc", ".py", ".md", ".sh") or path.name in (
                "CMakeLists.txt", "install-packages", ".clang-tidy")):
            yield path


def main(arguments):
    count_only = "--count" in arguments
    counts, files, texts = collections.Counter(), 0, 0
    named = [argument for argument in arguments if argument != "--count"]
    for path in checked_files(named):
        files += 1
        for line, text, is_comment in texts_of(path):
            texts += 1
            for at in fragments(text, is_comment):
                name = path.relative_to(HERE)
                counts[str(name.parent)] += 1
                if not count_only:
                    shown = " ".join(text[at:at + 90].split())
                    print(f"{name}:{line + text.count(chr(10), 0, at)}: \"{shown}\" has no noun before its clause")
    if count_only:
        for folder, count in sorted(counts.items()):
            print(f"{count:5} {folder}")
    print(f"comments: {texts} texts in {files} files, {sum(counts.values())} begin with a bare clause")
    if files == 0 and not named:
        return 1
    return 0 if count_only or not counts else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
