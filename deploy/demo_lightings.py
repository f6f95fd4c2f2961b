"""The requests of the demonstration and a table of their answers: two lightings of any store, a table of group means.

requests STORE FOLDER: writes emission-N.json (what `lambert render` reads) and request-N.json (what the daemon
reads), N = 1, 2. table STORE FOLDER N: prints the mean radiosity of each group in answer-N.json.
"""
import json
import sys

import h5py
import numpy as np

MOST_ROWS = 24


class Scene:
    def __init__(self, path):
        with h5py.File(path, "r") as store:
            mesh = store["mesh"]
            self.area = mesh["area"][:]
            self.group = mesh["group"][:]
            self.names = [name.decode() if isinstance(name, bytes) else name for name in mesh["group_names"][:]]
            self.emission = mesh["emission"][:]

    def group_area(self, g):
        return self.area[self.group == g].sum()


def own_lights(scene):
    """The groups that glow by themselves, with their mean exitance in each channel."""
    lights = {}
    for g, name in enumerate(scene.names):
        inside = scene.group == g
        if scene.emission[:, inside].any():
            mean = (scene.emission[:, inside] * scene.area[inside]).sum(axis=1) / scene.group_area(g)
            lights[name] = [float(f"{value:.4g}") for value in mean]
    return lights


def glowing_wall(scene, lights):
    """The wall that glows in the second lighting: the left one, else the largest group that is no lamp."""
    dark = [g for g, name in enumerate(scene.names) if name not in lights]
    for g in dark:
        if "left" in scene.names[g].lower():
            return g
    return max(dark or range(len(scene.names)), key=scene.group_area)


def write_requests(store, folder):
    scene = Scene(store)
    channels = scene.emission.shape[0]
    lights = own_lights(scene)
    first = "its own lights: " + ", ".join(lights) if lights else None
    if not lights:
        brightest = max(range(len(scene.names)), key=scene.group_area)
        lights = {scene.names[brightest]: [1.0] * channels}
        first = f"it has no lights of its own, so {scene.names[brightest]} glows"
    wall = glowing_wall(scene, lights)
    # As much power as a fifth of the lamps', in a warm white where there is colour.
    power = sum(np.mean(value) * scene.group_area(scene.names.index(name)) for name, value in lights.items())
    warm = np.array([1.6, 1.0, 0.4]) if channels == 3 else np.ones(channels)
    glow = (0.2 * power / scene.group_area(wall) * warm).tolist()
    second = dict(lights)
    second[scene.names[wall]] = [float(f"{value:.4g}") for value in glow]
    titles = [first, f"the same and a warm glow of {scene.names[wall]}"]
    for number, (title, groups) in enumerate(zip(titles, (lights, second)), start=1):
        if channels == 1:
            groups = {name: value[0] for name, value in groups.items()}
        emission = {"groups": groups}
        with open(f"{folder}/emission-{number}.json", "w", encoding="utf-8") as file:
            json.dump(emission, file)
        with open(f"{folder}/request-{number}.json", "w", encoding="utf-8") as file:
            json.dump({"emission": emission}, file)
        with open(f"{folder}/title-{number}.txt", "w", encoding="utf-8") as file:
            file.write(title)


def print_table(store, folder, number):
    scene = Scene(store)
    with open(f"{folder}/answer-{number}.json", encoding="utf-8") as file:
        answer = json.load(file)
    with open(f"{folder}/title-{number}.txt", encoding="utf-8") as file:
        print(f"lighting {number}: {file.read()}")
    radiosity = np.atleast_2d(np.array(answer["radiosity"]))
    print("times, ms:", ", ".join(f"{stage} {ms:.3g}" for stage, ms in answer["time_ms"].items()))
    print(f"  {'group':28} {'mean radiosity, W/m2':>24}")
    largest = sorted(range(len(scene.names)), key=scene.group_area, reverse=True)[:MOST_ROWS]
    for g, name in enumerate(scene.names):
        if g not in largest:
            continue
        inside = scene.group == g
        mean = (radiosity[:, inside] * scene.area[inside]).sum(axis=1) / scene.group_area(g)
        print(f"  {name[:28]:28} {'  '.join(f'{value:10.4g}' for value in mean):>24}")
    if len(scene.names) > MOST_ROWS:
        print(f"  ... and {len(scene.names) - MOST_ROWS} smaller groups")


if __name__ == "__main__":
    if sys.argv[1] == "requests":
        write_requests(sys.argv[2], sys.argv[3])
    else:
        print_table(sys.argv[2], sys.argv[3], int(sys.argv[4]))
