#!/usr/bin/env python3
"""How warm do the surfaces of an enclosure become, and how much heat flows from each, by radiation alone?

    heat.py SCENE floor=303.15K ceiling=290K walls=0W/m2

Each surface, a group of the scene, has a temperature, or the net heat that is put into it; 0 W/m2 is an insulated one. A grey
diffuse surface of the reflectance rho has the emissivity eps = 1 - rho. It emits eps sigma T^4, reflects rho H of the heat H that
comes to it, and loses q = eps (sigma T^4 - H): the radiosity equation. So the operator of light answers it. With the mean heat K_gh
that a unit emission of the surface h brings to g, after all reflections, the emissions e of surfaces are the solution of

    e_g = eps_g sigma T_g^4                  where the temperature is given,
    e_g - eps_g sum_h K_gh e_h = q_g         where the heat is given,

one number for each surface, however many elements it has. The scene has one channel and counts in W. It prints T, q, and the heat
of the whole surface, whose sum is what leaves the scene through its openings.
"""
import argparse
import re
import sys

import numpy as np

import lambert

SIGMA = 5.670374419e-8  # W/(m2 K4), exact since 2019 but for its further digits


def responses(scene, names):
    """K [g, h]: one question for all surfaces."""
    found = scene.reduce([{h: 1} for h in names], groups=names, quantity="irradiance", limit=False)
    return np.array([found[g]["mean"] for g in names], float).reshape(len(names), len(names))


def steady_state(scene, temperatures, heats):
    """Temperatures (K) and net heat (W/m2) of the groups, from those of them that are given; they are all groups of the scene."""
    names = list(scene.groups)
    missing = [name for name in names if (name in temperatures) == (name in heats)]
    if missing:
        raise ValueError(f"{', '.join(missing)}: each surface needs a temperature or a heat; the scene has {', '.join(names)}")
    if scene.channels != 1 or scene.units != "W":
        raise ValueError(f"{scene.name} has {scene.channels} channels and counts in {scene.units}; heat needs one channel in W")
    if not temperatures:
        raise ValueError("one surface at least needs a temperature")
    eps = np.array([1 - float(scene.groups[name].reflectance[0]) for name in names])
    K = responses(scene, names)
    balance = np.eye(len(names)) - eps[:, None] * K  # of emissions, the net heat
    system, right = balance.copy(), np.zeros(len(names))
    for g, name in enumerate(names):
        if name in temperatures:
            system[g], right[g] = np.eye(len(names))[g], eps[g] * SIGMA * temperatures[name] ** 4
        else:
            right[g] = heats[name]
    e = np.linalg.solve(system, right)
    if (e < 0).any():
        raise ValueError(f"{names[int(e.argmin())]} would have to emit less than nothing: more heat is taken away than comes to it")
    with np.errstate(divide="ignore", invalid="ignore"):  # a surface that reflects all has no temperature
        T = (e / (eps * SIGMA)) ** 0.25
    return dict(zip(names, T)), dict(zip(names, balance @ e))


def condition(text):
    found = re.fullmatch(r"(.+)=([-+0-9.eE]+)(K|W/m2)", text)
    try:
        name, value, unit = found[1], float(found[2]), found[3]
        if unit == "K" and value < 0:
            raise ValueError
    except (TypeError, ValueError):
        raise argparse.ArgumentTypeError(f"{text}: must be GROUP=TEMPERATUREK or GROUP=HEATW/m2, such as floor=303.15K") from None
    return name, value, unit


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", help="http://HOST:PORT/NAME, or a store, STORE.h5")
    parser.add_argument("surface", nargs="+", type=condition, help="GROUP=TEMPERATUREK or GROUP=HEATW/m2; .back of a group is one of its own")
    options = parser.parse_args()
    scene = lambert.Scene(options.scene)
    unknown = [name for name, _, _ in options.surface if name not in scene.groups]
    if unknown:
        raise ValueError(f"no group is called {unknown[0]}; there are {', '.join(scene.groups)}")
    T, q = steady_state(scene, *({name: value for name, value, unit in options.surface if unit == of} for of in ("K", "W/m2")))
    for name, group in scene.groups.items():
        print(f"{name:16} {group.area:9.3f} m2  {T[name]:9.3f} K  {T[name] - 273.15:8.2f} C  {q[name]:10.3f} W/m2  {q[name] * group.area:12.3f} W")
    print(f"{scene.n} elements; {sum(q[name] * group.area for name, group in scene.groups.items()):.3f} W leave the scene")


if __name__ == "__main__":
    try:
        main()
    except (OSError, ValueError, lambert.LambertError) as error:
        sys.exit(f"heat.py: {error}")
