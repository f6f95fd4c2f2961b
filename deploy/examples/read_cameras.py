"""Prints the cameras that came with the scene of a store, as `lambert render --camera` reads them."""

import sys

import h5py

with h5py.File(sys.argv[1]) as store:
    cameras = []
    if "cameras" in store:
        group = store["cameras"]
        names = [name.decode() for name in group["names"][()]]
        cameras = list(zip(names, group["eye"][()], group["direction"][()], group["fov"][()]))

for name, eye, direction, fov in cameras:
    numbers = ",".join(f"{x:.9g}" for x in (*eye, *(eye + direction), fov))
    print(f"{name}: --camera {numbers}")
