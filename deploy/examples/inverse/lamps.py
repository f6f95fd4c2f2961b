#!/usr/bin/env python3
"""How far are the lamps of an office dimmed, so that its desks are well lit by the least power?

Every desk k has sensors with the illuminances v = J d of the dimmers d. Asked for is

    min  sum_i W_i d_i,   0 <= d <= 1,   mean of v over desk k >= 500 lx,   every v of desk k >= 0.6 of that mean,

with all bounces of light. This is a linear programme, which HiGHS solves exactly once `jacobian` has given J. The other methods
do not know J. They see the light of the dimmers that they try, and but for COBYLA a gradient by `adjoint`:

    L-BFGS-B   of the augmented Lagrangian, one gradient a step
    SLSQP      with a mean and a soft minimum for every desk
    COBYLA     without gradients

Each of the `--methods` prints its power, how far that is above the first one's, by how much the worst sensor or mean misses, and its
questions.
"""
import argparse
import json
import sys
import time

import numpy as np
from scipy.optimize import linprog, minimize

import lambert

LUX, UNIFORMITY, LUMENS_PER_WATT = 500, 0.6, 120


class Desks:
    """The problem: rules @ light(d) >= bounds, with light relative to the mean that is wanted; and how often it was asked."""

    def __init__(self, scene, lamps, desks):
        self.scene, self.desks, self.questions = scene, desks, 0
        self.lamps = [name for name in scene.luminaires if name.split(".")[0] == lamps]
        if not self.lamps:
            raise ValueError(f"no luminaire is called {lamps}; there are {', '.join(sorted({n.split('.')[0] for n in scene.luminaires})) or 'none'}")
        self.columns = [list(scene.luminaires).index(name) for name in self.lamps]
        self.watts = np.array([scene.luminaires[name].lumens for name in self.lamps]) / LUMENS_PER_WATT
        counts = [len(scene.sensors[desk]) for desk in desks]
        self.of = np.repeat(np.arange(len(desks)), counts)  # the desk of each sensor
        self.means = (self.of == np.arange(len(desks))[:, None]) / np.array(counts)[:, None]
        self.even = np.eye(len(self.of)) - UNIFORMITY * self.means[self.of]
        self.rules = np.vstack([self.means, self.even])
        self.bounds = np.repeat([1.0, 0.0], [len(desks), len(self.of)])

    def light(self, d):
        """At the sensors, by all bounces: one question."""
        self.questions += 1
        dimmers = dict(zip(self.lamps, np.clip(d, 0, None).tolist()))
        found = self.scene.irradiance({"luminaires": dimmers}, select={"sensors": self.desks}, limit=False, stated=False)
        return found.values.astype(float) / LUX

    def gradient(self, g):
        """Of g @ light(d), by the dimmers: one question."""
        self.questions += 1
        weights = {desk: g[self.of == k] / LUX for k, desk in enumerate(self.desks)}
        return self.scene.adjoint({"sensors": weights}, "luminaires", doubles=True)[self.columns]

    def missing(self, v):
        return np.maximum(self.bounds - self.rules @ v, 0)


def linear_programme(p):
    J = p.scene.jacobian({"sensors": p.desks}, by=["luminaires"])["luminaires"][:, p.columns] / LUX
    p.questions += 1
    found = linprog(p.watts, -p.rules @ J, -p.bounds, bounds=(0, 1), method="highs")
    if found.status == 2:
        raise ValueError(f"no dimmers from 0 to 1 give every desk {LUX} lx and a uniformity of {UNIFORMITY}")
    return found.x


def lbfgsb(p, rounds=30):
    scale, multipliers, weight = p.watts.sum(), np.zeros(len(p.bounds)), 10.0

    def lagrangian(d):
        v = p.light(d)
        push = np.maximum(multipliers + weight * (p.bounds - p.rules @ v), 0)
        value = p.watts @ d / scale + (push @ push - multipliers @ multipliers) / (2 * weight)
        return value, p.watts / scale - p.gradient(p.rules.T @ push)

    d, before = np.full(len(p.lamps), 0.5), np.inf
    for _ in range(rounds):
        d = minimize(lagrangian, d, jac=True, method="L-BFGS-B", bounds=[(0, 1)] * len(d), options={"ftol": 1e-9}).x
        v = p.light(d)
        missing = p.missing(v).max()
        if missing < 2e-4:
            break
        multipliers = np.maximum(multipliers + weight * (p.bounds - p.rules @ v), 0)
        weight, before = weight * (2 if missing > before / 2 else 1), missing
    return d


def slsqp(p):
    scale, d, groups = p.watts.sum(), np.full(len(p.lamps), 0.5), range(len(p.desks))
    slopes = np.array([p.gradient(row) for row in p.means])  # means are linear

    for sharp in (30, 300, 3000):  # the soft minimum is below the true one by log(sensors) / sharp at most
        def spare(d):
            v = p.light(d)
            low = [p.even[p.of == k] @ v for k in groups]
            return np.concatenate([p.means @ v - 1, [x.min() - np.log(np.exp(sharp * (x.min() - x)).sum()) / sharp for x in low]])

        def slope(d):
            v, rows = p.light(d), []
            for k in groups:
                x = p.even[p.of == k] @ v
                share = np.exp(sharp * (x.min() - x))
                rows.append(p.gradient(share / share.sum() @ p.even[p.of == k]))
            return np.vstack([slopes, rows])

        d = minimize(lambda d: p.watts @ d / scale, d, jac=lambda d: p.watts / scale, method="SLSQP", bounds=[(0, 1)] * len(d),
                     constraints={"type": "ineq", "fun": spare, "jac": slope}, options={"maxiter": 200, "ftol": 1e-8}).x
    return d


def cobyla(p):
    found = minimize(lambda d: p.watts @ d / p.watts.sum(), np.full(len(p.lamps), 0.5), method="COBYLA", options={"maxiter": 5000, "rhobeg": 0.2},
                     constraints=[{"type": "ineq", "fun": lambda d: p.rules @ p.light(d) - p.bounds},
                                  {"type": "ineq", "fun": lambda d: np.concatenate([d, 1 - d])}], tol=1e-4)
    return np.clip(found.x, 0, 1)


METHODS = {"programme": linear_programme, "L-BFGS-B": lbfgsb, "SLSQP": slsqp, "COBYLA": cobyla}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", help="http://HOST:PORT/NAME, or a store, STORE.h5")
    parser.add_argument("--lamps", default="wide", help="the luminaires that are dimmed, by the beginning of their names (preset wide)")
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=list(METHODS), help="those that are tried (preset: all)")
    parser.add_argument("-o", "--output", help="write the dimmers of the first method as an emission, for lambert solve and render")
    options = parser.parse_args()
    scene = lambert.Scene(options.scene, check=1)
    p = Desks(scene, options.lamps, [name for name in scene.sensors if name.startswith("desk-")])
    print(f"{scene.n} elements, {len(p.lamps)} lamps of {p.watts.sum():.0f} W, {len(p.desks)} desks with {len(p.of)} sensors")
    optimum = None
    for name in options.methods:
        p.questions, began = 0, time.monotonic()
        d = METHODS[name](p)
        seconds, questions = time.monotonic() - began, p.questions
        watts = p.watts @ d
        optimum = watts if optimum is None else optimum  # the first one is compared with
        if name == options.methods[0] and options.output:
            with open(options.output, "w", encoding="ascii") as out:
                json.dump({"luminaires": dict(zip(p.lamps, d.round(6).tolist()))}, out)
        print(f"{name:10} {watts:8.2f} W  {100 * (watts / optimum - 1):+.3f} %  misses {100 * p.missing(p.light(d)).max():.3f} %  "
              f"{questions} questions  {questions / seconds:.0f} a second")


if __name__ == "__main__":
    try:
        main()
    except (OSError, ValueError, lambert.LambertError) as error:
        sys.exit(f"lamps.py: {error}")
