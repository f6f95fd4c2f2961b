#!/usr/bin/env python3
"""Which luminaire of a catalogue hangs at each place, so that the desks of an office are lit evenly by the least power?

At each place hangs one luminaire of the catalogue or none: one of the distributions that the scene has there, of 750 lm to 6,000 lm.
With the mean and the standard deviation of the illuminance at all sensors asked for is

    min  sum of watts,   mean - 2 deviation >= 300 lx.

Only means and variances are needed. Light is linear: of dimmers x the mean is m x and the variance is x C x, with the means m
and the covariances C of the columns of one `jacobian`. No further question is asked. (`--by reduce` asks the scene for every
configuration instead, 64 at a time.) The search is one of variable neighbourhoods: the best change or exchange of luminaires, as
long as one is better, then more and more random changes at once, for so many `--rounds`.

The bound is of the relaxed problem, in which a place may have parts of several luminaires: a linear programme to which planes
below the deviation are added, until they touch it.
"""
import argparse
import json
import sys
import time

import numpy as np
from scipy.optimize import linprog

import lambert

LUX, SPREAD, LUMENS_PER_WATT = 300, 2, 120
FLUXES = np.arange(1, 9) / 8  # parts of the 6,000 lm that the luminaires of the scene have


class Catalogue:
    """A configuration is a row of choices, one for each place: 0 for none, else 1 + the number of a column of the place."""

    def __init__(self, scene, by="jacobian"):
        self.scene, self.by, self.tried, self.seconds, self.best, self.least = scene, by, 0, 0.0, None, np.inf
        self.sets, self.names = list(scene.sensors), list(scene.luminaires)
        places = sorted({name.split(".", 1)[1] for name in self.names if "." in name})
        if not places or not self.sets:
            raise ValueError(f"{scene.name} has no rows of luminaires and sensors; office.py writes both")
        at = [[i for i, name in enumerate(self.names) if name.endswith("." + place)] for place in places]
        self.items = [[(i, flux) for i in columns for flux in FLUXES] for columns in at]
        lumens = np.array([scene.luminaires[name].lumens for name in self.names])
        self.watts = np.array([[0] + [lumens[i] * flux / LUMENS_PER_WATT for i, flux in items] for items in self.items])
        self.dimmers = np.zeros((*self.watts.shape, len(self.names)))  # of each item of each place
        for place, items in enumerate(self.items):
            for k, (i, flux) in enumerate(items, 1):
                self.dimmers[place, k, i] = flux
        if by == "jacobian":
            J = scene.jacobian({"sensors": self.sets}, by=["luminaires"])["luminaires"].astype(float)
            self.m, self.C = J.mean(0), np.cov(J, rowvar=False, bias=True)

    def statistics(self, choices):
        """Watts, mean and variance of each row of choices."""
        places, began = np.arange(len(self.watts)), time.perf_counter()
        watts, x = self.watts[places, choices].sum(1), self.dimmers[places, choices].sum(1)
        if self.by == "jacobian":
            mean, variance = x @ self.m, ((x @ self.C) * x).sum(1)
        else:
            lights = [{"luminaires": {self.names[i]: row[i] for i in np.flatnonzero(row)}} for row in x]
            found = [self.scene.reduce(lights[k:k + 64], sensors=self.sets, figures=("mean", "variance"), limit=False)
                     for k in range(0, len(lights), 64)]
            parts = np.array([[np.concatenate([part[name][figure] for part in found]) for name in self.sets]
                              for figure in ("mean", "variance")])
            share = np.array([len(self.scene.sensors[name]) for name in self.sets], float)
            share /= share.sum()
            mean = share @ parts[0]
            variance = share @ (parts[1] + (parts[0] - mean) ** 2)
        self.tried, self.seconds = self.tried + len(choices), self.seconds + time.perf_counter() - began
        return watts, mean, variance

    def cost(self, choices):
        """Watts, and 2 W for each lx that is missing, which is a little more than an lx takes. Keeps the best that lacks none."""
        watts, mean, variance = self.statistics(choices)
        missing = np.maximum(LUX - mean + SPREAD * np.sqrt(variance), 0)
        valid = np.where(missing > 0, np.inf, watts)
        if valid.min() < self.least:
            self.least, self.best = valid.min(), choices[valid.argmin()].copy()
        return watts + 2 * missing

    def descend(self, choice):
        """The best of all single changes and exchanges, until none is better."""
        places, kinds = self.watts.shape
        one, (a, b) = np.arange(places * kinds), np.triu_indices(places, 1)
        cost = self.cost(choice[None])[0]
        while True:
            near = np.repeat(choice[None], len(one) + len(a), 0)
            near[one, one // kinds] = one % kinds
            near[len(one) + np.arange(len(a)), a], near[len(one) + np.arange(len(a)), b] = choice[b], choice[a]
            costs = self.cost(near)
            if costs.min() >= cost - 1e-9:
                return choice, cost
            choice, cost = near[costs.argmin()], costs.min()

    def search(self, rounds, seed, most=5):
        """The best configuration found; `rounds` is how often one is shaken."""
        random, (places, kinds) = np.random.default_rng(seed), self.watts.shape
        (held, cost), size = self.descend(np.full(places, kinds - 1)), 1
        for _ in range(rounds):
            shaken, at = held.copy(), random.choice(places, min(size, places), replace=False)
            shaken[at] = random.integers(0, kinds, len(at))
            found, other = self.descend(shaken)
            held, cost, size = (found, other, 1) if other < cost - 1e-9 else (held, cost, size % most + 1)
        if self.best is None:
            raise ValueError(f"no configuration found has a mean less {SPREAD} deviations of {LUX} lx")
        return self.best

    def bound(self):
        """Watts below which no configuration can be."""
        x, watts = self.dimmers[:, 1:].reshape(-1, len(self.names)), self.watts[:, 1:].ravel()
        m, C = x @ self.m, x @ self.C @ x.T
        one = np.repeat(np.eye(len(self.watts)), self.watts.shape[1] - 1, axis=1)  # at most one luminaire at a place
        planes, part = [m], np.full(len(m), 1 / self.watts.shape[1])
        for _ in range(100):
            deviation = np.sqrt(part @ C @ part)
            if planes[1:] and LUX - m @ part + SPREAD * deviation < 1e-4 * LUX:
                break
            planes.append(m - SPREAD * C @ part / deviation)
            found = linprog(watts, np.vstack([one, -np.array(planes)]), [1] * len(one) + [-LUX] * len(planes), bounds=(0, 1))
            part, least = found.x, found.fun
        return least


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", help="http://HOST:PORT/NAME, or a store, STORE.h5")
    parser.add_argument("--by", choices=("jacobian", "reduce"), default="jacobian", help="where statistics come from (preset jacobian)")
    parser.add_argument("--rounds", type=int, default=300, help="random starts of the search (preset 300)")
    parser.add_argument("--seed", type=int, default=1, help="of the random starts (preset 1)")
    parser.add_argument("-o", "--output", help="write the dimmers as an emission, for lambert solve and render")
    options = parser.parse_args()
    scene = lambert.Scene(options.scene, check=1)
    catalogue = Catalogue(scene, options.by)
    best = catalogue.search(options.rounds, options.seed)
    tried, seconds = catalogue.tried, catalogue.seconds
    (watts,), (mean,), (variance,) = catalogue.statistics(best[None])
    least = (catalogue if options.by == "jacobian" else Catalogue(scene)).bound()
    print(f"{scene.n} elements, {len(catalogue.watts)} places, {catalogue.watts.shape[1] - 1} luminaires in the catalogue")
    print(f"{watts:.0f} W by {np.count_nonzero(best)} luminaires, mean {mean:.1f} lx, deviation {np.sqrt(variance):.1f} lx")
    print(f"at most {100 * (watts / least - 1):.2f} % above the least power, {least:.1f} W or more")
    print(f"{tried} configurations by {options.by}, {tried / seconds:.0f} a second")
    if options.output:
        x = catalogue.dimmers[np.arange(len(best)), best].sum(0)
        with open(options.output, "w", encoding="ascii") as out:
            json.dump({"luminaires": {catalogue.names[i]: x[i] for i in np.flatnonzero(x)}}, out)


if __name__ == "__main__":
    try:
        main()
    except (OSError, ValueError, lambert.LambertError) as error:
        sys.exit(f"catalogue.py: {error}")
