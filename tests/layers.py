#!/usr/bin/env python3
"""Proves who includes whom: every quoted include against the list of its folder, every third-party header in its home;
and that the paths of a store's groups are spelled in one header.

usage: tests/layers.py [FILE...]     nothing: all files
"""
import os
import re
import subprocess
import sys

HERE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
CHECKED = ("include/*.h", "store/*.[ch]", "solver/*.[ch]", "solver/*.inc", "server/*.[ch]", "tests/bench/*.[ch]")

# Groups of folders that others name together.
BELOW_LINALG = "lambert/ store/ solver/base/"
BELOW_OPERATOR = f"{BELOW_LINALG} solver/linalg/"
OPERATOR = f"{BELOW_OPERATOR} solver/operator/"
SCENE = f"{BELOW_LINALG} solver/scene/"
FORMFACTOR = (f"{OPERATOR} solver/daylight/ {SCENE} solver/formfactor/formfactor.h solver/formfactor/recipe.h "
              "solver/formfactor/factor_cost.h solver/formfactor/source.h solver/formfactor/closing.h "
              "solver/formfactor/repair.h solver/formfactor/leaving.h solver/formfactor/scratch.h "
              "solver/formfactor/sky_bounce.h")
METHOD = f"{OPERATOR} solver/method/"
# Headers that the methods share; folders of methods do not know each other.
METHOD_SHARED = ("solver/method/method.h solver/method/choice.h solver/method/report.h solver/method/tall_factors.h "
                 "solver/method/inverse_rows.h solver/method/norm.h solver/method/many_lights.h solver/method/reference.h")

# folder: the prefixes that its files may include beside their own folder; * stands for each folder within
ALLOWED = {
    "include/lambert": "",
    "store": "lambert/",
    "solver/base": "lambert/ store/",
    "solver/base/options": "lambert/ store/ solver/base/",
    "solver/base/scene": "lambert/ store/ solver/base/",
    "solver/linalg": f"{BELOW_LINALG}",
    "solver/operator": f"{BELOW_OPERATOR} solver/operator/wavelet/",
    "solver/operator/wavelet": f"{BELOW_OPERATOR}",
    "solver/operator/blocks": f"{BELOW_OPERATOR}",
    "solver/operator/corners": f"{BELOW_LINALG}",
    "solver/operator/refine": f"{OPERATOR}",
    "solver/operator/groups": f"{OPERATOR}",
    "solver/operator/stated": f"{OPERATOR}",
    "solver/operator/scene": f"{OPERATOR}",
    "solver/codec": f"{BELOW_LINALG} solver/operator/operator.h solver/operator/luminaire_light.h solver/operator/sensor_light.h solver/operator/blocks/importance.h solver/operator/groups/ solver/operator/stated/",
    "solver/codec/gltf": "lambert/ store/ solver/base/ solver/codec/ solver/operator/groups/groups.h solver/operator/corners/",
    "solver/daylight": f"{BELOW_LINALG}",
    "solver/luminaire": f"{BELOW_LINALG}",
    "solver/shadow": f"{BELOW_LINALG} solver/daylight/sky_tiles.h solver/scene/plane.h",
    "solver/scene": f"{BELOW_LINALG}",
    "solver/scene/facet": f"{SCENE}",
    "solver/scene/import": f"{SCENE}",
    "solver/scene/generate": f"{SCENE}",
    "solver/formfactor": f"{FORMFACTOR} solver/formfactor/",
    "solver/formfactor/visibility": f"{FORMFACTOR}",
    "solver/formfactor/rows": f"{FORMFACTOR} solver/formfactor/visibility/",
    "solver/formfactor/rays": f"{FORMFACTOR} solver/formfactor/visibility/ solver/formfactor/rows/",
    "solver/formfactor/glass": f"{FORMFACTOR} solver/formfactor/visibility/ solver/formfactor/rows/ solver/formfactor/rays/",
    "solver/formfactor/clusters": f"{FORMFACTOR} solver/formfactor/visibility/",
    "solver/formfactor/exchange": f"{FORMFACTOR} solver/formfactor/clusters/",
    "solver/formfactor/sight": (f"{FORMFACTOR} solver/formfactor/visibility/ solver/formfactor/clusters/ solver/formfactor/exchange/"),
    "solver/formfactor/pairs": (f"{FORMFACTOR} solver/formfactor/visibility/ solver/formfactor/rows/ solver/formfactor/rays/ "
        "solver/formfactor/clusters/ solver/formfactor/exchange/ solver/formfactor/sight/ solver/formfactor/glass/"),
    "solver/formfactor/blocks": (f"{FORMFACTOR} solver/formfactor/visibility/ solver/formfactor/exchange/ solver/formfactor/sight/"),
    "solver/walk": ("lambert/ store/status.h solver/base/ solver/scene/mesh.h solver/formfactor/leaving.h solver/formfactor/visibility/"),
    "solver/figures": f"{BELOW_LINALG}",
    "solver/direct": f"{SCENE} solver/luminaire/luminaire.h solver/luminaire/placed.h solver/formfactor/visibility/",
    "solver/sensor": f"{SCENE} solver/daylight/ solver/luminaire/ solver/figures/ solver/direct/ solver/formfactor/ solver/operator/sensor_light.h",
    "solver/lightmap": (f"{SCENE} solver/operator/luminaire_light.h solver/operator/groups/groups.h solver/sensor/ solver/direct/ solver/luminaire/ solver/daylight/ solver/formfactor/ "
        "solver/codec/ solver/output/mesh_gltf.h solver/render/exr.h solver/render/picture.h solver/render/image.h"),
    "solver/method": f"{OPERATOR}",
    "solver/method/*": f"{OPERATOR} {METHOD_SHARED}",
    "solver/light": f"{OPERATOR} solver/codec/ solver/daylight/ solver/shadow/ {SCENE} solver/formfactor/ solver/walk/moving_light.h",
    "solver/output": f"{SCENE} solver/operator/stated/answer_error.h solver/codec/ solver/light/",
    "solver/render": f"{OPERATOR} {SCENE} solver/formfactor/visibility/",
    "solver/adapt": f"solver/daylight/ {METHOD} {SCENE} solver/formfactor/",
    "solver/precompute/forecast": f"{METHOD} {SCENE} solver/formfactor/",
    "solver/precompute": (f"solver/precompute/forecast/ solver/figures/ solver/direct/ solver/luminaire/ solver/sensor/ solver/daylight/ {METHOD} {SCENE} solver/formfactor/ solver/light/ "
        "solver/operator/stated/answer_error.h solver/adapt/ solver/walk/"),
    "solver/verify": f"{METHOD} solver/direct/ solver/luminaire/ solver/sensor/ {SCENE} solver/formfactor/ solver/light/ solver/precompute/ solver/walk/walk.h",
    "solver/verbs": "lambert/ store/ solver/",
    "solver": "lambert/ store/ solver/",
    "server/net": f"{BELOW_LINALG} solver/codec/",
    "server/queue": f"{BELOW_LINALG} solver/codec/",
    "server/scene": f"{OPERATOR} solver/codec/ solver/daylight/ solver/shadow/ server/queue/ server/config.h",
    "server/route": f"{OPERATOR} solver/codec/ solver/daylight/ solver/figures/ server/net/ server/queue/ server/scene/ server/config.h",
    "server/http": f"{OPERATOR} solver/codec/ server/net/ server/queue/ server/scene/ server/route/ server/config.h",
    "server": f"{OPERATOR} solver/codec/ solver/waits.h server/",
    "tests/bench": "lambert/ store/ solver/ server/ support/ tests/bench/suites/stats.h tests/bench/suites/mesh_truths.h",
    "tests/bench/suites": (f"{METHOD} {SCENE} solver/formfactor/ solver/precompute/ solver/render/shade.h solver/walk/walk.h "
        "solver/walk/reuse.h solver/walk/moving_light.h solver/adapt/ solver/waits.h"),
}

# third-party header: the only files or folders that may include it
HOME = {
    "hdf5.h": "store/",
    "xxhash.h": "store/ solver/scene/",
    "assimp/": "solver/scene/import/assimp_reader.c",
    "embree3/": "solver/formfactor/visibility/embree.h",
    "embree4/": "solver/formfactor/visibility/embree.h",
    "lapacke.h": "solver/method/ solver/linalg/core.c",
    "cblas.h": "solver/method/ solver/linalg/",
    "OpenEXR/": "solver/render/exr.c",
    "png.h": "solver/render/image.c solver/scene/import/image_decode.c",
    "turbojpeg.h": "solver/scene/import/image_decode.c solver/scene/import/picture_files.c",
    "webp/": "solver/scene/import/image_decode.c",
    "meshoptimizer.h": "solver/scene/import/gltf_meshopt.c",
    "jansson.h": ("solver/codec/ solver/light/light_path.c solver/luminaire/list_values.h solver/scene/import/gltf_file.h "
        "solver/scene/import/gltf_nodes.h solver/verbs/ tests/bench/"),
    "microhttpd.h": "server/http/ tests/bench/ready_server.c",
    "zlib.h": "server/route/content_coding.c",
    "zstd.h": "server/route/content_coding.c",
}

QUOTED = re.compile(r'^ *# *(?:include|define CPU_KERNELS) *"([^"]*)"', re.M)
THIRD = re.compile(r"^ *# *include *<([^>]*)>", re.M)
GROUPS = "store/groups.h"
GROUP = re.compile(r'^#define STORE_[A-Z_]* "(/[a-z_]*)"', re.M)


def wrong_includes(name, allowed):
    """The message for each include of a file that its folder may not have."""
    with open(os.path.join(HERE, name), encoding="utf-8") as file:
        source = file.read()
    folder = os.path.dirname(name)
    for header in QUOTED.findall(source):
        if os.path.dirname(header) != folder and not header.startswith(tuple(allowed.split())):
            yield f'{name} includes "{header}"; beside its own {folder}/ may include: {allowed}'
    for header in THIRD.findall(source):
        for third, places in HOME.items():
            if header.startswith(third) and not name.startswith(tuple(places.split())):
                yield f"{name} includes <{header}>, whose home is: {places}"


def path_of_a_group():
    """Matches a group's path in a string of its own; a part of a group may be called as another: STORE_ERROR "/sky"."""
    with open(os.path.join(HERE, GROUPS), encoding="utf-8") as file:
        return re.compile(r'(?:^|[^A-Z_ ]|[^A-Z_] )"(?:%s)[]"/ :,[]' % "|".join(GROUP.findall(file.read())), re.M)


def spelled_groups(name, group):
    """Yields a complaint about each path of a group that a file spells."""
    with open(os.path.join(HERE, name), encoding="utf-8") as file:
        for number, line in enumerate(file, 1):
            if group.search(line):
                yield f"{name}:{number}: {GROUPS} has this path"


def main(named):
    files = subprocess.run(["git", "ls-files", "-co", "--exclude-standard", *CHECKED], cwd=HERE, check=True, capture_output=True,
                           text=True).stdout.split()
    files = [name for name in files if (not named or name in named) and os.path.exists(os.path.join(HERE, name))]
    broken = 0
    group = path_of_a_group()
    for name in files:
        folder = os.path.dirname(name)
        allowed = ALLOWED.get(folder, ALLOWED.get(f"{os.path.dirname(folder)}/*"))
        wrong = [f"{folder}/ has no line in tests/layers.py"] if allowed is None else list(wrong_includes(name, allowed))
        if name.startswith(("solver/", "server/", "store/")) and name != GROUPS:
            wrong += spelled_groups(name, group)
        for text in wrong:
            print(f"layers: {text}")
            broken += 1
    if not named and len(files) < 20:
        print(f"layers: only {len(files)} files found, is this the repository?")
        return 1
    print(f"layers: {len(files)} files, {broken} wrong includes and paths")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
