#!/usr/bin/env python3
"""Finds sentences that begin with a relative clause that has no noun ("What of g is hidden."), in comments, docstrings,
texts that a user reads, and documents; a question may begin so. Fails where there is one.

Counts sentences of C comments that begin with Of, In, By or With and have no verb of their own ("Of an entry: its column."),
where the comment stands on its own lines and has five words. Prints them and fails where the tree has more than
FRAGMENTS_MOST; of named files it prints them and does not fail.

usage: tests/comments.py [--count] [FILE|FOLDER...]     --count prints the numbers for each folder and does not fail; named
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

FRAGMENTS_MOST = 49
WORDS_LEAST = 5  # of a comment; shorter ones are notes ("In bytes.")
# A sentence ends at a full stop that is not of an abbreviation, or at a blank line, and may begin after a colon.
END = re.compile(r"(?<!\beq)(?<!\bfig)(?<!\bal)(?<!\bcf)[.!?][\")]?(?=\s|\Z)|\n[ \t]*\n|\Z")
NOUNLESS = re.compile(r"(?:\A\s*|[.!?][\")]?\s+|:\s+|\n[ \t]*\n\s*)((?:Of|In|By|With)\b)")
TOKEN = re.compile(r"[a-z_']+|[<>]=?|:?=|[^\sa-z]")
RELATION = re.compile("[<>]=?|:?=")
# Verbs whose forms are rarely nouns or participles: those of REGULAR have a third person in -s.
REGULAR = """add allow appear apply arrive ask become begin belong bring cancel carry cast choose come compare compute contain
    converge cross decide define depend describe differ disappear divide draw drop emit err exceed exist fail fall fill find
    follow get give go grow happen help hide hold include join keep know lack leave let lie lose make meet move need occur
    outlive overflow read receive reflect remain replace reproduce say see send serve shine stand stay suffice take tell
    touch vanish wait weigh write"""
FORMS = """is are was were has have had do does did may might can cannot could must shall should will would
    became began came fell gave grew knew saw took went
    costs covers raises reaches returns rises runs shows starts stops uses works"""
VERBS = set(FORMS.split())
for verb in REGULAR.split():
    VERBS |= {verb, verb[:-1] + "ies" if re.search("[^aeo]y$", verb) else verb + "es" if re.search("(?:s|sh|ch|o)$", verb)
              else verb + "s"}
# The first are verbs after a plural; any word is one after a pronoun, and none is after an auxiliary.
EITHER = set("come cost count cover end need pass reach run share start state sum use".split())
PRONOUNS = set("it they he we you nobody".split())
AUXILIARY = set("to not may might can cannot could must shall should will would do does did".split())
CLAUSES = set("which who whom whose where when while if unless because since until what whatever whether that".split())
BEFORE_PRONOUN = set("and or with by of for is are as to than in at but".split())
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


def is_verb(before, word):
    if RELATION.fullmatch(word):
        return True
    if word in VERBS:
        return before not in AUXILIARY
    if before in PRONOUNS:
        return word[0].isalpha()
    if before in ("that", "which", "who"):
        return re.fullmatch("[a-z]+s", word) is not None and word not in ("this", "as")
    return word in EITHER and re.search("[^']s$", before) is not None


def has_verb(sentence):
    """True if there is a finite verb, or the relation of a formula, that no subordinate clause has."""
    clauses, before = 0, ""
    tokens = TOKEN.findall(sentence.lower())
    for word, after in zip(tokens, tokens[1:] + [""]):
        demonstrative = word == "that" and (after in ("of", "which") or before in BEFORE_PRONOUN
                                            or not re.match("[a-z)]", before))
        if word == ";":
            return False
        if word in ",:":
            clauses = 0
        elif not demonstrative and word in CLAUSES or word == "as" and before == ",":
            clauses += 1
        elif not demonstrative and is_verb(before, word):
            if clauses == 0:
                return True
            clauses -= 1
        before = word
    return False


def verbless(text):
    """(offset, sentence) of the sentences of a C comment that begin with Of, In, By or With and have no verb."""
    if len(text.split()) >= WORDS_LEAST:
        for found in NOUNLESS.finditer(text):
            sentence = text[found.start(1):END.search(text, found.end(1)).end()]
            if not has_verb(sentence):
                yield found.start(1), sentence


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
    counts, without, files, texts = collections.Counter(), [], 0, 0
    named = [argument for argument in arguments if argument != "--count"]
    for path in checked_files(named):
        files += 1
        name, c_lines = path.relative_to(HERE), []
        if path.suffix in (".c", ".h", ".inc"):
            c_lines = path.read_text(encoding="utf-8").split("\n")
        for line, text, is_comment in texts_of(path):
            texts += 1
            for at in fragments(text, is_comment):
                counts[str(name.parent)] += 1
                if not count_only:
                    shown = " ".join(text[at:at + 90].split())
                    print(f"{name}:{line + text.count(chr(10), 0, at)}: \"{shown}\" has no noun before its clause")
            if is_comment and c_lines and c_lines[line - 1].lstrip().startswith("/*"):
                without += [(name, line + text.count("\n", 0, at), sentence) for at, sentence in verbless(text)]
    too_many = len(without) > FRAGMENTS_MOST
    if not count_only and (named or too_many):
        for name, line, sentence in without:
            print(f"{name}:{line}: \"{' '.join(sentence[:90].split())}\" has no verb")
    if count_only:
        for folder, count in sorted(counts.items()):
            print(f"{count:5} {folder}")
        for folder, count in sorted(collections.Counter(str(name.parent) for name, _, _ in without).items()):
            print(f"{count:5} {folder} without a verb")
    print(f"comments: {texts} texts in {files} files, {sum(counts.values())} begin with a bare clause, {len(without)} have no "
          f"verb (at most {FRAGMENTS_MOST})")
    if files == 0 and not named:
        return 1
    return 0 if count_only or not (counts or too_many and not named) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
