"""Writes the seeds of the fuzz harnesses: small requests, arrays, stores and replies of every form.

usage: make_seeds.py LAMBERT FOLDER   (the program, and where to put json/ adjoint/ ...)
"""
import base64
import json
import pathlib
import shutil
import struct
import subprocess
import sys
import tempfile

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "service"))
from make_store import Luminaires, Sensors

lambert, folder = sys.argv[1], pathlib.Path(sys.argv[2]).absolute()
for name in ("json", "adjoint", "npy", "store", "import", "index", "head", "image", "gltf", "weather", "skies", "luminaire",
             "luminaire_reply", "placed", "sensors"):
    (folder / name).mkdir(parents=True, exist_ok=True)

emissions = [[1, 2.5, 0, 1e-3, 0.125, 3, 4], [[1] * 7, [2] * 7, [0.5] * 7], {"elements": [1, 3], "values": [2, 5.5]},
             {"elements": [0], "values": [[1, 2, 3]]}, {"groups": {"lamp": 3, "wall": [1, 2, 3]}}, {"sky": [1, 2, 3, 4, 5]},
             {"sky": [1, 2, 3, 4, 5], "groups": {"wall.red": 1}}, {"emitters": [1, 0, 2]},
             {"luminaires": {"spot": 1, "rows": 0.5}}, {"luminaires": {"row": [1, 2, 3], "s*": 2}, "sky": [1, 2, 3, 4, 5], "groups": {"lamp": 1}}]
count = 0
for e in emissions:
    for body in ({"emission": e}, {"emissions": [e, e], "quantity": "irradiance"},
                 {"emission": e, "select": {"elements": [1, 1, 6]}, "quantity": "indirect"},
                 {"emission": e, "select": {"groups": ["wall"]}, "tolerance": 1e-4},
                 {"emission": e, "at": "faces", "select": {"groups": ["wall"]}},
                 {"emission": e, "select": {"faces": [3, 0]}},
                 {"emission": e, "reduce": {"groups": ["wall"], "with": ["mean", "sum", "min", "max", "uniformity",
                                                                        "variance"]}},
                 {"emission": e, "select": {"sensors": ["room"]}},
                 {"emission": e, "reduce": {"sensors": ["room.b", "room"], "with": ["mean", "share", "min"], "at_least": [1, 300]}},
                 {"emissions": [e, e], "reduce": {"sensors": ["room"], "with": ["ugr", "share"], "at_least": [2]}},
                 {"cotangent": {"sensors": {"room.a": {"values": [1, -2]}, "room.b": 3}}, "emission": e, "gradient": ["reflectance"]},
                 {"cotangent": e, "quantity": "radiosity", "gradient": ["emission", "reflectance"], "emission": e},
                 {"cotangent": [1] * 7, "gradient": ["luminaires", "groups"], "emission": e}):
        for blank in " \t\n\r":
            for name in ("adjoint",) if "cotangent" in body else ("json",):
                (folder / name / f"{count:03}").write_text(json.dumps(body) + blank)
            count += 1

for k, blank in enumerate(" \t\n\r"):
    (folder / "adjoint" / f"by{k}").write_text(json.dumps({"of": {"sensors": ["room"]}, "by": ["groups", "sky"]}) + blank)
    for of in {"groups": ["lamp"]}, {"elements": [3, 0]}:
        (folder / "adjoint" / f"{next(iter(of))}{k}").write_text(json.dumps({"of": of, "quantity": "indirect"}) + blank)
    (folder / "adjoint" / f"batch{k}").write_text(json.dumps({"cotangents": [[1] * 7, {"groups": {"lamp": {"mean": -1}}}]}) + blank)
    (folder / "adjoint" / f"all{k}").write_text(json.dumps({"of": {"sensors": ["room.b", "room.a"]}}) + blank)

# Skies, and small weather of both formats; the last byte says the format and what becomes of gaps.
for k, sky in enumerate(["even", {"name": "clear", "place": {"latitude": 1, "longitude": 2, "zone": 3}, "date": "1 May 9:00"},
                         {"direct": 1, "diffuse": 2, "sun": {"azimuth": 3, "altitude": 4}, "north": 5, "lux_outside": 6, "dew_point": 7},
                         {"weather": True, "hour": 4380.5, "gaps": "fill", "photometric": True, "sun_in_tiles": False}]):
    (folder / "skies" / f"{k}").write_text(json.dumps({"sky": sky}))
    (folder / "skies" / f"many{k}").write_text(json.dumps({"skies": [sky, sky]}))
(folder / "skies" / "sun").write_text('{"place":{"latitude":1,"longitude":2,"zone":3},"hours":[0,12.5,8760],"year":1999}')
(folder / "skies" / "weather").write_text('{"gaps":"fill","text":"place x\\nlatitude 1\\n"}')
wea = ("place x\nlatitude 37.5\nlongitude 122\ntime_zone 120\nsite_elevation 2\nweather_data_file_units 1\n"
       + "".join(f"6 {day} {hour}.5 {9999 if hour == 12 else 100} 50\n" for day in (20, 22, 21) for hour in range(24)))
epw = ("LOCATION,x,XX,USA,TMY3,0,37.5,-122,-8,2\nDESIGN CONDITIONS,0\nTYPICAL/EXTREME PERIODS,0\nGROUND TEMPERATURES,0\n"
       "HOLIDAYS/DAYLIGHT SAVINGS,No,0,0,0\nCOMMENTS 1,\nCOMMENTS 2,\nDATA PERIODS,1,1,Data,Sunday,6/20,6/23\n"
       + "".join(f"2001,6,{day},{hour},60,?,15,999,60,101300,0,0,300,0,{9999 if hour == 12 else 100},50,0\n"
                 for day in (20, 21, 21, 22) for hour in range(1, 25)))
for k in range(3):
    (folder / "weather" / f"wea{k}").write_text(wea + chr(2 * k))
    (folder / "weather" / f"epw{k}").write_text(epw + chr(2 * k + 1))

# Files of luminaires; the last byte says the lamp set, and the extension of the name.
files = pathlib.Path(__file__).resolve().parent.parent / "fixtures" / "luminaires"
for k, file in enumerate(sorted(files.glob("*/*.*"))):
    if file.stat().st_size < 4000:
        (folder / "luminaire" / file.name).write_bytes(file.read_bytes() + bytes([k % 12]))
for k, opening in enumerate(("-1 -1 0", "-1 0 0", ".3 1 .1", "-1 2 -1", "0 1 -1", "-1 -1 -1")):
    for type_, planes in ((1, "0 30 90"), (1, "0 120 240"), (1, "90 180 270"), (1, "0 90 180"), (2, "0 45 90"), (3, "-60 0 60")):
        (folder / "luminaire" / f"small{k}-{type_}-{planes}").write_text(
            f"{('', 'IESNA91', 'IESNA:LM-63-1995', 'IESNA:LM-63-2002', 'IES:LM-63-2019')[k % 5]}\n[LAMP] x\n[MORE] y\n"
            f"TILT=INCLUDE\n1 2 0 90 1 .5\n1 1000 2 2 3 {type_} {1 + k % 2} {opening}\n.9 1 9\n0 90\n{planes}\n1 2 3 4e1 5,6\n\0")

for k, change in enumerate((b"", b"\x10", b"\0\0x", b"\x08\0\1", b"\xf8\1\xff", b"\0\2\1\0\3\1", b"\x30\2\2\x38\2\2")):
    (folder / "luminaire_reply" / str(k)).write_bytes(change)

# Lists of luminaires; the last byte says the extension of the name, and the unit.
entry = {"name": "a", "file": "f", "at": [1, 2, 3]}
row = {"name": "r", "group": "g", "file": "w", "from": [1, 2, 3], "steps": [[1, 0, 0], [0, 1, 0]], "counts": [2, 3]}
for k, more in enumerate(({}, {"aim": [1, 0, -1], "c0": [0, 1, 0], "cct": 3000}, {"aim_at": [1, 2, 0], "c0": 30, "colour": [1, 2, 3]},
                          {"turn": {"axis": [1, 2, 3], "degrees": 45}, "dim": .5, "maintenance": .8, "flux": 1000},
                          {"lamp_set": 2, "opening": "point", "ignore": ["x", "y z"], "aim": [1, 0, 0]})):
    (folder / "placed" / f"one{k}").write_text(json.dumps({"luminaires": [{**entry, **more}]}) + chr(k))
    (folder / "placed" / f"row{k}").write_text(
        json.dumps({"unit": "ft", "files": {"w": "f.ies", "v": "g"}, "luminaires": [entry, {**row, **more}]}) + chr(64 + k))
for k, mark in enumerate(",;\t"):
    names = ["name", "file", "x", "y", "z", "aim_x", "aim_y", "aim_z", "c0_degrees", "dim", "group", "ignore", "turn_x", "red"]
    lines = [names, ["a", '"f ""1"""', *"1231", "0", "-1", "90", "0.5", "g", "x|y"], ["b", "f", *"123"], ["c", "f", *"123", "", "1", "2"]]
    (folder / "placed" / f"csv{k}").write_text("".join(mark.join(line) + "\r\n" for line in lines) + chr(1 + k))

# Lists of sensors; the last byte says the extension of the name, the unit, the axis that points up, and if there is a scene.
area = {"polygon": [[0, 0, 0], [4, 0, 0], [4, 3, 0], [1, 1, 0], [0, 3, 0]], "height": .8, "spacing": .5, "border": .1}
sets = [("points", {"at": [1, 2, 3]}), ("points", {"at": [[1, 2, 3], [2, 2, 3]], "normal": [[0, 1, 0], [1, 1, 1]]}), ("grids", area),
        ("grids", {"over": "floor", "spacing": "en12464"}), ("eyes", {"at": [1, 2, 3], "view": [0, 1, 0]}), ("cubes", area),
        ("cylinders", {"over": "rest", "height": 1.2, "spacing": 1}), ("semicylinders", {"at": [1, 2, 3], "look": [1, 0, 0]}),
        ("spheres", {"at": [[1, 2, 3]]}), ("probes", {"at": [[1, 2, 3], [2, 2, 3]], "axes": "y-up"}),
        ("probes", {"from": [0, 0, 1], "steps": [[1, 0, 0], [0, .5, 0]], "counts": [3, 2], "axes": "scene"})]
for k, (kind, members) in enumerate(sets):
    (folder / "sensors" / f"one{k}").write_text(json.dumps({kind: [{"name": "a", **members}]}) + chr(4 * k))
    (folder / "sensors" / f"two{k}").write_text(
        json.dumps({"unit": "ft", kind: [{"name": "a", **members}, {"name": "b", **members}]}) + chr(32 + k))
for k, mark in enumerate(",;\t"):
    lines = [["name", "x", "y", "z", "nx", "ny", "nz"], ["a", *"123001"], ["a", *"123", "", "", ""], ['"b"', "1.5", "-1e1", *"30101"]]
    (folder / "sensors" / f"csv{k}").write_text("".join(mark.join(line) + "\r\n" for line in lines) + chr(1))
(folder / "sensors" / "pts").write_text("# x\n1 2 3 0 0 1\n\t1,2 .5e1 0 1 0\n\2")

# Files of emissions: an EMISSION by itself.
for k, e in enumerate(emissions):
    (folder / "json" / f"file{k}").write_text(json.dumps(e) + "\t")

for k, (shape, kind) in enumerate([((5,), "<f4"), ((5,), "<f8"), ((3, 5), "<f4"), ((2, 1, 5), "<f8"), ((2, 3, 5), "<f4"),
                                   ((5,), ">f4"), ((4,), "<f4"), ((5,), "<i4"), ((0, 5), "<f4")]):
    with open(folder / "npy" / f"{k}", "wb") as f:
        np.lib.format.write_array(f, np.ones(shape, kind), version=(1 + k % 3, 0))

# Stores as small as can be: one of every kind.
with tempfile.TemporaryDirectory() as scratch:
    def run(*arguments):
        subprocess.run([lambert, *map(str, arguments)], check=True, cwd=scratch, stdout=subprocess.DEVNULL)
    run("generate", "box", "--divisions", 1, "-o", "box.obj")
    for k, how in enumerate((["exact"], ["low-rank", "--rank", 2], ["2msc", "--rank", 2], ["sparse", "--threshold", "1e-2"],
                             ["emitters", "--emitters", "sky", "--sky", "grid:2x2"],
                             ["low-rank", "--rank", 2, "--store-precision", "i8"],
                             ["exact", "--keep-form-factors", "--sky", "grid:2x2"],
                             ["hierarchical", "--keep-form-factors"])):
        run("precompute", "box.obj", "--mesh", "faces", "--rays", 64, "--probes", 0, "--quiet", "-o", folder / "store" / f"{k}.h5",
            "--method", *how)
    lit = Luminaires(6).add_to(shutil.copy(folder / "store" / "0.h5", folder / "store" / "luminaires.h5"))
    Sensors(6, lights=lit, eyes=1).add_to(shutil.copy(folder / "store" / "luminaires.h5", folder / "store" / "eyes.h5"))
    # Few emitters, of which the last are luminaires.
    (pathlib.Path(scratch) / "list.json").write_text(json.dumps({"luminaires": [
        {"name": f"row.{k}", "group": "row", "file": "made/lambertian-1000cd-1x1m.ies", "at": [.3 * k + .3, .5, .9]} for k in range(2)]}))
    run("precompute", "box.obj", "--mesh", "faces", "--rays", 64, "--probes", 0, "--quiet", "-o", folder / "store" / "few.h5",
        "--luminaires", "list.json", "--assets", pathlib.Path(__file__).resolve().parents[1] / "fixtures" / "luminaires", "--lights", "lm", "--sky", "grid:2x2", "--emitters", "sky")
    run("generate", "box", "--divisions", 3, "-o", "box.obj")
    run("precompute", "box.obj", "--mesh", "faces", "--probes", 0, "--quiet", "-o", folder / "store" / "blocks.h5", "--form-factors", "blocks",
        "--epsilon", .99, "--keep-form-factors")

# The reply of the importing process: a header, then points, elements, names, materials, lights, textured faces, images.
def import_header(status, message, warnings, omitted, *counts):
    return struct.pack("<8sQ480s2048sQ13Q", b"lamsoup", status, message, warnings, omitted, *counts)


body = struct.pack("<9d", 0, 0, 0, 1, 0, 0, 0, 1, 0) + struct.pack("<7I", 0, 1, 2, 0xFFFFFFFF, 0, 0, 0) + b"a\0" + b"m\0"
colours = struct.pack("<6d3Qd", .5, .5, .5, 0, 0, 0, 1, 1, 0, 0)
plain = struct.pack("<6I6d", *[0] * 6, *[0] * 6)
tiled = struct.pack("<6I6d", 1, 1, 1, 2, 0, 0, 1, 0, 0, 0, 1, 0)
face = struct.pack("<3d16f12f2I", 0, 0, 0, *[1] * 28, 0, 0) + struct.pack("<I", 0)
image = struct.pack("<2Q", 2, 1) + bytes(range(6))
(folder / "import" / "one").write_bytes(import_header(0, b"", b"", 0, 3, 1, 1, 1, 2, 1, 2, 0, 0, 0, 0, 0, 0) + body + colours + plain * 2)
light = struct.pack("<64s2I12d", b"lamp", 1, 1, 1, 2, 3, 0, 0, -1, 100, 1, .5, 0, .25, .5)
(folder / "import" / "lit").write_bytes(import_header(0, b"", b"", 0, 3, 1, 1, 1, 2, 1, 2, 0, 1, 0, 0, 0, 0)
                                        + body + colours + plain * 2 + light)
(folder / "import" / "textured").write_bytes(import_header(0, b"", b"", 0, 3, 1, 1, 1, 2, 1, 2, 0, 0, 0, 0, 1, 1)
                                             + body + colours + tiled + plain + face + image)
(folder / "import" / "refused").write_bytes(import_header(4, b"no", b"w\nv", 3, *[0] * 13))


# Images, and a glTF with one in each place that it may have.
fixtures = pathlib.Path(__file__).resolve().parents[1] / "fixtures" / "textures"
for file in fixtures.iterdir():
    (folder / "image" / file.name).write_bytes(file.read_bytes())
jpeg = (fixtures / "tile.jpg").read_bytes()
turned = {"KHR_texture_transform": {"offset": [.1, .2], "rotation": 1, "scale": [2, 3], "texCoord": 1}}
document = {"asset": {"version": "2.0"}, "buffers": [{}], "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": len(jpeg)}],
            "images": [{"bufferView": 0}, {"uri": "none.png"}, {"uri": "data:;base64," + base64.b64encode(jpeg).decode()}],
            "samplers": [{"wrapS": 33071, "wrapT": 33648}], "accessors": [{"bufferView": 0, "componentType": 5123, "count": 2, "type": "VEC2"}],
            "textures": [{"source": 0, "sampler": 0}, {"source": 1}, {"source": 2}, {"extensions": {"EXT_texture_webp": {"source": 0}}}],
            "meshes": [{"primitives": [{"attributes": {"TEXCOORD_0": 0}, "material": 1}]}], "extensionsUsed": ["KHR_materials_unlit"],
            "extensions": {"KHR_lights_punctual": {"lights": [{"type": "spot", "color": [1, .5, 0], "intensity": 9, "range": 3, "spot": {
                "innerConeAngle": .2, "outerConeAngle": .5}}, {"type": "point", "name": "bulb"}]}}, "scenes": [{"nodes": [0, 1]}],
            "nodes": [{"name": "a", "extensions": {"KHR_lights_punctual": {"light": k}}} for k in range(2)],
            "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": k, "extensions": turned if k == 0 else {}}},
                           "emissiveTexture": {"index": 3}, "alphaMode": "MASK",
                           "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 3}}} for k in range(3)]}
text = json.dumps(document).encode()
text += b" " * (-len(text) % 4)
whole = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(jpeg), b"BIN\0") + jpeg
(folder / "gltf" / "all.glb").write_bytes(b"glTF" + struct.pack("<2I", 2, 12 + len(whole)) + whole)
(folder / "gltf" / "all.gltf").write_bytes(text)


# The reply of the process that reads headers: a head, then objects with their attributes.
def attribute(kind, name, text=b"", value=0):
    return struct.pack("<4IQ", kind, len(name), len(text), 0, value) + name + text


def item(kind, name, attributes=(), status=0, fault=b"", shape=(0, 0, 0, 0), dims=(), offset=0):
    """shape: type, is_text, rank, bytes of a value"""
    kind_of_value, is_text, rank, value_size = shape
    return struct.pack("<8I6Q", kind, status, len(name), len(fault), len(attributes), kind_of_value, is_text, rank, value_size,
                       *(list(dims) + [0] * 4)[:4], offset) + name + fault + b"".join(attributes)


def reply(items, n_attributes, status=0, message=b""):
    body = b"".join(items)
    return struct.pack("<8sQ480s3Q", b"lamhead", status, message, len(items), n_attributes, len(body)) + body


root = item(0, b"/\0", [attribute(0, b"format\0", b"lambert\0"), attribute(1, b"number\0", value=1), attribute(3, b"other\0"),
                        attribute(2, b"version\0", value=1)])
items = [root, item(0, b"/checksum\0"), item(1, b"/mesh-area\0", shape=(1, 0, 1, 8), dims=[100], offset=4096),
         item(1, b"/names\0", shape=(0, 1, 1, 5), dims=[3], offset=8192), item(2, b"/odd\0", status=4, fault=b"store.h5: odd\0"),
         item(1, b"/checksum/mesh-area\0", shape=(3, 0, 2, 8), dims=[1, 1], offset=8)]
(folder / "index" / "whole").write_bytes(reply(items, 4))
(folder / "index" / "refused").write_bytes(reply([root], 4, 4, b"store.h5: refused"))
(folder / "index" / "shared").write_bytes(reply(items + [item(1, b"/x\0", shape=(0, 0, 1, 4), dims=[9], offset=4100)], 4))

for k, lines in enumerate((('for=192.0.2.1;proto=http, For="[2001:db8::17]:80"', "", "localhost:8317", "https://a.example"),
                           ("", "203.0.113.9, 198.51.100.1:80, 10.0.0.2", "[::1]:80", "http://[::1]:80"),
                           ('for=_hidden;by="a\\"b"', "_hidden, unknown", "a.example", "null"), ("for", ",,", "[", "://"))):
    (folder / "head" / f"{k}").write_text("\n".join(lines))
