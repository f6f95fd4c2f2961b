#!/usr/bin/env python3
"""How do the surfaces of a room have to be painted, so that it looks as in a wanted picture?

The picture is the radiosity B* of all elements, [C][n], as `lambert solve -o wanted.npy` writes it, under the light of the scene's own
lamps. Unknown are the reflectances of some of its groups, one for each channel:

    min J = 1/2 sum_ci A_i (B_ci - B*_ci)^2 / (sum_i A_i mean(B*_c)^2),   0.01 <= rho <= 0.95.

B is no linear function of reflectances: light is reflected again and again. For reflectances that are tried the scene makes a
variant of itself, which takes no new form factors. There the answer to `radiosity` gives J, and one `adjoint` with the gradient
"reflectance" gives dJ/drho_i of all elements, whose sums over surfaces L-BFGS-B takes as its slopes.

The store keeps its factors (`lambert precompute --method low-rank --keep-factors`), and a daemon has `--max-variants` and a `--token`.
"""
import argparse
import os
import sys
import time

import numpy as np
from scipy.optimize import minimize

import lambert

LEAST, MOST = 0.01, 0.95


class Painter:
    """The scene under reflectances that are tried, [surfaces, C]."""

    def __init__(self, scene, surfaces, wanted):
        if wanted.shape != scene.shape:
            raise ValueError(f"the picture has the shape {list(wanted.shape)}, must have {list(scene.shape)} as {scene.name} has")
        self.scene, self.surfaces, self.questions, self.tried = scene, surfaces, 0, 0
        self.wanted = wanted.reshape(scene.channels, scene.n).astype(float)
        self.elements = [scene.groups[name].indices for name in surfaces]
        self.light = {name: group.emission.tolist() for name, group in scene.groups.items() if group.emission.any()}
        if not self.light:
            raise ValueError(f"{scene.name} has no light of its own")
        mean = self.wanted @ scene.areas / scene.areas.sum()
        self.weight = scene.areas / scene.areas.sum() / mean[:, None] ** 2  # [C, n]

    def picture(self, rho):
        """The variant, which is deleted by who asked for it, and its radiosity."""
        self.tried += 1
        made = self.scene.variant(f"try-{os.getpid()}-{self.tried}", {name: row.tolist() for name, row in zip(self.surfaces, rho)})
        B = made.radiosity(self.light, limit=False).values.astype(float).reshape(self.wanted.shape)
        return made, B

    def goal(self, x):
        rho = x.reshape(len(self.surfaces), -1)
        made, B = self.picture(rho)
        try:
            g = self.weight * (B - self.wanted)
            slopes = made.adjoint(g.reshape(self.scene.shape), "reflectance", emission=self.light, doubles=True).reshape(B.shape)
        finally:
            made.delete()
        self.questions += 2
        return (g * (B - self.wanted)).sum() / 2, np.array([slopes[:, of].sum(1) for of in self.elements]).ravel()

    def find(self):
        # J is near 0 at the end, where the preset tolerances, made for goals of about 1, would stop too early.
        begin = np.full(len(self.surfaces) * self.scene.channels, 0.5)
        return minimize(self.goal, begin, jac=True, method="L-BFGS-B", bounds=[(LEAST, MOST)] * len(begin),
                        options={"ftol": 1e-12, "gtol": 1e-8})


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", help="http://HOST:PORT/NAME, or a store, STORE.h5")
    parser.add_argument("wanted", help="the wanted radiosity, [C][n], an NPY file")
    parser.add_argument("surfaces", nargs="+", help="groups that are painted")
    parser.add_argument("--token", help="of a daemon that has one (preset: LAMBERT_TOKEN)", default=os.environ.get("LAMBERT_TOKEN"))
    options = parser.parse_args()
    scene = lambert.Scene(options.scene, token=options.token)
    painter = Painter(scene, options.surfaces, np.load(options.wanted))
    began = time.monotonic()
    found = painter.find()
    seconds = time.monotonic() - began
    for name, row in zip(options.surfaces, found.x.reshape(len(options.surfaces), -1)):
        print(f"{name:16} {' '.join(f'{value:.4f}' for value in row)}")
    print(f"{scene.n} elements, differs by {100 * np.sqrt(2 * found.fun / scene.channels):.2g} % of the mean (root mean square); "
          f"{painter.tried} variants, {painter.tried / seconds:.0f} a second")


if __name__ == "__main__":
    try:
        main()
    except (OSError, ValueError, lambert.LambertError) as error:
        sys.exit(f"materials.py: {error}")
