#!/usr/bin/env python3
"""Lays out server/route/openapi.json: a value that fits in a line takes one, of any other each member begins a line.

usage: tests/openapi.py     rewrites the file; service.openapi fails where that would change it
"""
import json
import pathlib

FILE = pathlib.Path(__file__).resolve().parents[1] / "server" / "route" / "openapi.json"
WIDTH = 160


def lay_out(value, indent="", before=0):
    """The JSON of a value that stands `before` characters into a line of this indent."""
    line = json.dumps(value, ensure_ascii=False)
    if len(indent) + before + len(line) < WIDTH or not isinstance(value, (dict, list)) or not value:
        return line
    inner = indent + " "
    heads = [json.dumps(key, ensure_ascii=False) + ": " for key in value] if isinstance(value, dict) else [""] * len(value)
    values = value.values() if isinstance(value, dict) else value
    members = ",\n".join(inner + head + lay_out(member, inner, len(head)) for head, member in zip(heads, values))
    first, last = "{}" if isinstance(value, dict) else "[]"
    return f"{first}\n{members}\n{indent}{last}"


def text():
    return lay_out(json.loads(FILE.read_text(encoding="utf-8"))) + "\n"


if __name__ == "__main__":
    FILE.write_text(text(), encoding="utf-8")
