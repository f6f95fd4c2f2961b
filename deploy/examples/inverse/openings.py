#!/usr/bin/env python3
"""Which patches of a roof become skylights, at most 12 (`--most`), so that a hall has the most useful daylight in a year?

An open patch is an opal pane: a part of the light that comes to it from outside leaves it evenly below. So the hall is lit by few
emitters, the patches, and its store has the light of each alone (`--emitters`; Aguerre 2016, section 4.4.3). Their weights change
from hour to hour, as the site is lit by sky and sun, and in the shade of its tower. With the illuminance E_hi of the floor's
element i in the working hour h of the year (8 to 18) asked for is

    max  mean by area of the share of hours with 300 lx <= E_hi <= 3,000 lx,
    so that no element has more than 3,000 lx in more than --cap of the hours.

The search is one of variable neighbourhoods, of so many `--tries`: a patch is exchanged for another, opened, or closed, as long as
that is better; then one, two, three patches at once are moved at random. It begins with the greedy choice, which opens the best
patch each time. No choice can be better than the bound: at every element and hour the light of its own best patches, without a cap.

SITE and HALL are stores of hall.py's scenes; YEAR is written by `lambert sky WEATHER --photometric -o year.npy`.
"""
import argparse
import sys
import time

import numpy as np

import lambert

LOW, HIGH, PASSES, HOURS = 300, 3000, 0.5, (8, 18)  # lx, the part of the light that a pane passes, working hours


class Openings:
    def __init__(self, site, hall, year, cap):
        names = [name for name in site.groups if name.startswith("roof-")]
        tiles = len(site.sky) if site.sky else 0
        if not names or not hall.about.get("emitters") or len(hall.about["emitters"]) != len(names):
            raise ValueError(f"{site.name} has {len(names)} patches, {hall.name} as emitters {len(hall.about.get('emitters') or [])}; hall.py writes both")
        if year.ndim != 2 or year.shape[1] != tiles or len(year) % 24:
            raise ValueError(f"the year has the shape {list(year.shape)}, must have [24 days, {tiles}], as the sky of {site.name} has")
        hour = np.arange(len(year)) % 24
        year = year[(HOURS[0] <= hour) & (hour < HOURS[1])]
        self.names, self.cap, self.tried, self.hall, self.hours = names, cap, 0, hall, len(year)
        lit = year[year.any(1)]  # dark hours are neither useful nor too bright
        found = site.reduce([{"sky": row} for row in np.eye(tiles)], groups=names, quantity="irradiance", limit=False, photometric=True)
        outside = np.array([found[name]["mean"] for name in names], float)  # [patches, tiles], lx of 1 cd/m2
        self.emitted = (PASSES * lit @ outside.T).astype(np.float32)  # [hours, patches]
        self.inside = hall.irradiance([{"emitters": row} for row in np.eye(len(names))], select={"groups": ["floor"]}, limit=False,
                                      stated=False).values  # [patches, elements]
        area = hall.areas[hall.groups["floor"].indices]
        self.share = area / area.sum()
        self.near_to = frozenset(), self.light([])  # a choice whose light is known

    def light(self, chosen):
        """[hours, elements], lx."""
        chosen = sorted(chosen)
        return self.emitted[:, chosen] @ self.inside[chosen]

    def useful(self, chosen):
        """The mean share of useful hours; what the brightest element has above the cap counts against it ten times."""
        self.tried += 1
        E = self.near_to[1].copy()
        for p in chosen ^ self.near_to[0]:
            E += np.multiply.outer(self.emitted[:, p], self.inside[p] if p in chosen else -self.inside[p])
        bright = (E > HIGH).sum(0) / self.hours
        useful = (E >= LOW).sum(0) / self.hours - bright
        return float(self.share @ useful - 10 * np.maximum(bright - self.cap, 0).max())

    def stand_at(self, chosen):
        self.near_to = chosen, self.light(chosen)
        return self.useful(chosen)

    def greedy(self, most):
        chosen = frozenset()
        value = self.stand_at(chosen)
        while len(chosen) < most:
            other, best = max(((self.useful(chosen | {p}), chosen | {p}) for p in range(len(self.names)) if p not in chosen), key=lambda x: x[0])
            if other <= value:
                break
            chosen, value = best, self.stand_at(best)
        return chosen, value

    def near(self, chosen, most, random):
        """Neighbours in a random order: exchanges, openings, closings."""
        rest = [p for p in range(len(self.names)) if p not in chosen]
        found = [chosen - {p} | {q} for p in chosen for q in rest] + [chosen - {p} for p in chosen]
        found += [chosen | {q} for q in rest] if len(chosen) < most else []
        return [found[k] for k in random.permutation(len(found))]

    def search(self, most, tries, seed):
        random, (best, value), size = np.random.default_rng(seed), self.greedy(most), 0
        while self.tried < tries:
            chosen = best
            for _ in range(size):
                chosen = self.near(chosen, most, random)[0]
            found, better = self.stand_at(chosen), True
            while better and self.tried < tries:
                better = False
                for other in self.near(chosen, most, random):
                    at = self.useful(other)
                    if at > found + 1e-9:
                        chosen, found, better = other, self.stand_at(other), True
                        break
                    if self.tried >= tries:
                        break
            best, value, size = (chosen, found, 1) if found > value + 1e-9 else (best, value, size % 3 + 1)
        return best, value

    def bound(self, most):
        useful = np.zeros(len(self.share))
        for row in self.emitted:
            parts = row[:, None] * self.inside
            useful += np.partition(parts, -most, 0)[-most:].sum(0) >= LOW if most < len(parts) else parts.sum(0) >= LOW
        return float(self.share @ useful) / self.hours

    def asked(self, chosen):
        """The same light by the scene itself, an emission for each hour."""
        open_ = np.zeros(len(self.names))
        open_[sorted(chosen)] = 1
        return self.hall.irradiance([{"emitters": open_ * row} for row in self.emitted], select={"groups": ["floor"]}, limit=False, stated=False).values


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("site", help="http://HOST:PORT/NAME, or a store, STORE.h5")
    parser.add_argument("hall", help="another of these, of the hall")
    parser.add_argument("year", help="radiances of the sky for every hour of whole days, cd/m2, an NPY file")
    parser.add_argument("--most", type=int, default=12, help="patches that are open at most (preset 12)")
    parser.add_argument("--cap", type=float, default=0.05, help="the largest share of hours above 3,000 lx (preset 0.05)")
    parser.add_argument("--tries", type=int, default=4000, help="choices that are tried (preset 4000)")
    parser.add_argument("--seed", type=int, default=1, help="of the random order (preset 1)")
    options = parser.parse_args()
    p = Openings(lambert.Scene(options.site), lambert.Scene(options.hall), np.load(options.year), options.cap)
    greedy, began = p.greedy(options.most)[1], time.monotonic()
    p.tried = 0
    best, value = p.search(options.most, options.tries, options.seed)
    seconds = time.monotonic() - began
    began = time.monotonic()
    E = p.asked(best)
    asking = time.monotonic() - began
    print(f"open: {', '.join(p.names[k] for k in sorted(best)) or 'none'}")
    print(f"useful in {100 * value:.2f} % of {p.hours} hours; greedy {100 * greedy:.2f} %, bound {100 * p.bound(options.most):.2f} %")
    off = abs(E - p.light(best)).max() / max(E.max(), 1)
    print(f"{p.tried} choices, {p.tried / seconds:.0f} a second")
    print(f"the scene answers {len(E)} hours of the year, {len(E) / asking:.0f} a second, and differs by {off:.1e} of the most light")


if __name__ == "__main__":
    try:
        main()
    except (OSError, ValueError, lambert.LambertError) as error:
        sys.exit(f"openings.py: {error}")
