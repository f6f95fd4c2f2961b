#!/usr/bin/env python3
"""Dims a group of elements in a loop over HTTP and prints the mean irradiance of every group.

Usage: ask_daemon.py http://HOST:PORT GROUP
"""
import json
import sys
import urllib.parse
import urllib.request


def call(path, body=None):
    data = None if body is None else json.dumps(body).encode()
    request = urllib.request.Request(address + path, data, {"Content-Type": "application/json"})
    with urllib.request.urlopen(request) as answer:  # HTTPError's body is a problem document that says what is wrong
        return json.load(answer)


address, lamp = sys.argv[1].rstrip("/"), sys.argv[2]
scene = call("/v1/scenes")["scenes"][0]["name"]
path = "/v1/scenes/" + urllib.parse.quote(scene, safe="")
groups = [group["name"] for group in call(path)["groups"]]
for watts in (1, 2, 4, 8):
    answer = call(path + "/radiosity", {"emission": {"groups": {lamp: watts}}, "quantity": "irradiance",
                                        "reduce": {"groups": groups, "with": ["mean"]}})
    print(watts, json.dumps({name: figures["mean"] for name, figures in answer["groups"].items()}))
