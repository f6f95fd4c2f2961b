#!/usr/bin/env python3
"""Finds the emission of a group's elements, at least 0, that lights another group as evenly as asked for.

usage: inverse_light.py STORE.h5 http://HOST:PORT/v1/scenes/NAME SOURCE TARGET IRRADIANCE [WEIGHT] >EMISSION.npy

With e_s the emission of the elements of SOURCE, alike in all channels, H_i the irradiance of those of TARGET (mean of the
channels), H* the IRRADIANCE asked for and A areas, the program minimizes

    J(e) = 1/2 sum_i A_i (H_i / H* - 1)^2 / sum_i A_i + WEIGHT / 2 sum_s A_s (e_s / H*)^2 / sum_s A_s,   e >= 0,

by L-BFGS-B. The value takes one request, .../radiosity, and all of the gradient another one, .../adjoint, however many
unknowns there are. Both are arrays of NumPy over one connection. Areas, groups and reflectances are those of the store.
The emission is written to standard output, [n] for `lambert render --emission`; progress goes to standard error.
"""
import http.client
import io
import math
import sys
import time
import urllib.parse

import h5py
import numpy as np
from scipy.optimize import minimize


class Scene:
    """A scene of the daemon: light of emissions and gradients, [channels][n] each, both ways."""

    def __init__(self, address):
        url = urllib.parse.urlsplit(address)
        self.connection, self.path, self.requests = http.client.HTTPConnection(url.netloc), url.path.rstrip("/"), 0

    def ask(self, route, array):
        body = io.BytesIO()
        np.save(body, array.astype("<f4"))
        self.connection.request("POST", f"{self.path}/{route}", body.getvalue(),
                                {"Content-Type": "application/x-npy", "Accept": "application/x-npy"})
        answer = self.connection.getresponse()
        data = answer.read()
        self.requests += 1
        if answer.status != 200:  # a problem document says what is wrong
            sys.exit(f"{self.path}/{route}: {data.decode()}")
        return np.load(io.BytesIO(data)).astype(float)


def elements_of(store, name):
    names = [text.decode() for text in store["mesh/group_names"][()]]
    if name not in names:
        sys.exit(f"{store.filename}: no group is called {name}; there are {', '.join(names)}")
    return np.flatnonzero(store["mesh/group"][()] == names.index(name))


def number(text, least, name):
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not least <= value < math.inf:
        sys.exit(f"{name} {text}: must be a number of at least {least:g}")
    return value


def main(path, address, source, target, irradiance, weight="1e-4"):
    asked, weight, scene = number(irradiance, 1e-30, "IRRADIANCE"), number(weight, 0, "WEIGHT"), Scene(address)
    if source == target:
        sys.exit(f"{source}: SOURCE and TARGET are one group, but what TARGET emits would be taken for light that comes to it")
    with h5py.File(path, "r") as store:
        sources, targets = elements_of(store, source), elements_of(store, target)
        area, reflectance = store["mesh/area"][()].astype(float), np.atleast_2d(store["mesh/reflectance"][()]).astype(float)
    if not (reflectance[:, targets] > 0).all():
        sys.exit(f"{path}: group {target} has elements that reflect nothing, whose radiosity says nothing of their light")
    channels, n = reflectance.shape
    share, cost = area[targets] / area[targets].sum(), area[sources] / area[sources].sum()

    def value_and_gradient(x):  # x = e / H*
        E = np.zeros((channels, n))
        E[:, sources] = x
        B = scene.ask("radiosity", E * asked)
        # H = (B - E) / rho, and nothing of the target emits.
        off = (B[:, targets] / reflectance[:, targets]).mean(0) / asked - 1
        g = np.zeros((channels, n))
        g[:, targets] = share * off / (channels * reflectance[:, targets])  # dJ/dB times H*
        dJ = scene.ask("adjoint", g)[:, sources].sum(0)
        return (share @ off**2 + weight * (cost @ x**2)) / 2, dJ + weight * cost * x

    began = time.monotonic()
    found = minimize(value_and_gradient, np.ones(len(sources)), jac=True, method="L-BFGS-B", bounds=[(0, None)] * len(sources))
    seconds = time.monotonic() - began
    E = np.zeros(n)
    E[sources] = found.x * asked
    uneven = np.sqrt(max(2 * found.fun - weight * (cost @ found.x**2), 0))
    print(f"{target} has {irradiance} W/m2 within {100 * uneven:.2g} % (root mean square); {len(sources)} unknowns, "
          f"{found.nit} steps, {scene.requests} requests, {scene.requests / seconds:.0f} a second", file=sys.stderr)
    npy = io.BytesIO() # a pipe has no position, which numpy asks for
    np.save(npy, E.astype("<f4"))
    sys.stdout.buffer.write(npy.getvalue())


if __name__ == "__main__":
    if len(sys.argv) not in (6, 7):
        sys.exit(__doc__)
    try:
        main(*sys.argv[1:])
    except (OSError, http.client.HTTPException) as error:  # of the store or of the connection
        sys.exit(f"{sys.argv[1]}, {sys.argv[2]}: {error}")
