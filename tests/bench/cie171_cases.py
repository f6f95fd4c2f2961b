"""Scenes of CIE 171:2006, section 5, and the values that its cases have by their formulas.

A value that is printed there may be off by 6 % beside an opening; none is used here. Geometry: CIE 171:2006, as
github.com/jjathompson4/CyclesCIEtest (commit e006a473) and the validation of Iray by Dau Design (2016) repeat it. Metres, z up.
"""

import dataclasses
import math

import numpy as np

BLACK, LIT = "black", "lit"
POINT = "IESNA:LM-63-2002\n[MANUFAC] Lambert\nTILT=NONE\n"
ISOTROPIC_LUMENS = 10000
RADIANCE = 1000  # cd/m2, of the area source
REFLECTANCES = .05, .1, .2, .3, .4, .5, .6, .7, .8, .9, .95
SKIES = 1, 5, 12, 16
GROUND_ALBEDO = .3
SUN_ALTITUDE = math.radians(60)
# a, b, c, d, e of ISO 15469; 16, the traditional overcast sky, has a formula of its own
SKY_PARAMETERS = {1: (4, -.7, 0, -1, 0), 5: (0, -1, 0, -1, 0), 12: (-1, -.32, 10, -3, .45)}

# Wall points A to F above x = 2, and floor or ceiling points G to N, by their distances from the floor and from one wall.
WALL_HEIGHTS = dict(zip("ABCDEF", (2.75, 2.25, 1.75, 1.25, .75, .25)))
DEPTHS = dict(zip("GHIJKLMN", (.25, .75, 1.25, 1.75, 2.25, 2.75, 3.25, 3.75)))


@dataclasses.dataclass
class Case:
    """Values at the points of its scene, or one value of the whole scene."""

    number: str
    name: str
    unit: str
    expected: list


@dataclasses.dataclass
class Scene:
    """faces: (group, material, corners counterclockwise as seen from the lit side); points: (name, position, normal), none where
    an answer is of all elements: "lumens", the light that they receive, or "mean", the mean illuminance of reflected light.
    """

    faces: list
    cases: list
    points: list
    emission: float = 0  # of the material LIT, lm/m2 or W/m2
    reflectance: float = 0
    luminaire: tuple = ()  # text of its file, place
    answer: str = "sensors"
    sky: list = dataclasses.field(default_factory=list)  # luminances by direction, a case each
    options: tuple = ()


def vector(*values):
    return np.array(values, dtype=float)


def rows(*corners):
    return [vector(*corner) for corner in corners]


def flat(x0, x1, y0, y1, z):
    """A horizontal rectangle that faces up."""
    return rows((x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z))


def upright(x0, x1, z0, z1, y):
    """A rectangle across y that faces -y."""
    return rows((x0, y, z0), (x1, y, z0), (x1, y, z1), (x0, y, z1))


def sideways(y0, y1, z0, z1, x):
    """A rectangle across x that faces x."""
    return rows((x, y0, z0), (x, y1, z0), (x, y1, z1), (x, y0, z1))


def turned(corners):
    return corners[::-1]


def configuration_factor(point, normal, polygon):
    """The part of a polygon above the plane through a point, seen from there: Lambert's sum over edges,
        1/(2 pi) sum of the angle of each edge times the cosine of the normal of its plane."""
    height = [(corner - point) @ normal for corner in polygon]
    part = []
    for k, corner in enumerate(polygon):
        after = (k + 1) % len(polygon)
        if height[k] >= 0:
            part.append(corner - point)
        if height[k] * height[after] < 0:
            part.append(corner - point + (polygon[after] - corner) * height[k] / (height[k] - height[after]))
    total = 0.
    for one, other in zip(part, part[1:] + part[:1]):
        across = np.cross(one, other)
        sine = np.linalg.norm(across)
        if sine > 0:
            total += math.atan2(sine, one @ other) * (across @ normal) / sine
    return abs(total) / (2 * math.pi)


def sky_luminance(kind, sun):
    """Relative luminance of a standard sky, of directions [..., 3] above the horizon; the sun's own light is left out."""
    def luminance(direction):
        sine = np.clip(direction[..., 2], 1e-9, 1)
        if kind == 16:
            return 1 + 2 * sine
        a, b, c, d, e = SKY_PARAMETERS[kind]
        cosine = np.clip(direction @ sun, -1, 1)
        angle = np.arccos(cosine)
        gradation = 1 + a * np.exp(b / sine)
        return gradation * (1 + c * (np.exp(d * angle) - math.exp(d * math.pi / 2)) + e * cosine ** 2)
    return luminance


def horizontal_illuminance(luminance, heights=96, azimuths=720):
    """The integral of L sin a over the upper hemisphere, by Gauss in sin^2 a and evenly in azimuth."""
    node, weight = np.polynomial.legendre.leggauss(heights)
    sine, turn = np.sqrt((node + 1) / 2), np.arange(azimuths) * (2 * math.pi / azimuths)
    cosine = np.sqrt(1 - sine ** 2)
    direction = np.stack([cosine[:, None] * np.sin(turn), cosine[:, None] * np.cos(turn),
                          np.broadcast_to(sine[:, None], (heights, azimuths))], axis=-1)
    return float(math.pi * (weight / 2) @ luminance(direction).mean(axis=1))


def through(point, normal, corners, luminance, cells=24, nodes=6):
    """The illuminance at a point by light that comes through a rectangle: the integral of L cos over it, by Gauss in cells."""
    node, weight = np.polynomial.legendre.leggauss(nodes)
    at = ((np.arange(cells)[:, None] + (node + 1) / 2) / cells).ravel()
    share = np.tile(weight / 2, cells) / cells
    first, second = corners[1] - corners[0], corners[3] - corners[0]
    across = np.cross(first, second)
    to = corners[0] + at[:, None, None] * first + at[None, :, None] * second - point
    square = (to ** 2).sum(axis=-1)
    direction = to / np.sqrt(square)[..., None]
    kernel = np.maximum(direction @ normal, 0) * np.abs(direction @ across) / square
    return float((share[:, None] * share * kernel * luminance(direction)).sum())


def through_facade(point, normal, opening, sky, ground):
    """Likewise of an upright rectangle, which the horizon of the point divides into sky and ground."""
    x0, x1, z0, z1, y = opening
    horizon, total = min(max(point[2], z0), z1), 0.
    for low, high, light in ((z0, horizon, lambda direction: np.full(direction.shape[:-1], ground)), (horizon, z1, sky)):
        if high > low:
            total += through(point, normal, upright(x0, x1, low, high, y), light)
    return total


def wall_points():
    return [(name, vector(2, 0, z), vector(0, 1, 0)) for name, z in WALL_HEIGHTS.items()]


def floor_points(names="GHIJKLMN"):
    return [(name, vector(2, DEPTHS[name], 0), vector(0, 0, 1)) for name in names]


def ceiling_points():
    return [(name, vector(2, y, 3), vector(0, 0, -1)) for name, y in DEPTHS.items()]


def frame(x0, x1, y0, y1):
    """The parts of [0, 4] x [0, 4] about a rectangle."""
    whole = ((0, 4, 0, y0), (0, 4, y1, 4), (0, x0, y0, y1), (x1, 4, y0, y1))
    return [part for part in whole if part[0] < part[1] and part[2] < part[3]]


def room(height=3., without=()):
    """The fronts of a room of 4 x 4 m, black."""
    faces = {"floor": flat(0, 4, 0, 4, 0), "ceiling": turned(flat(0, 4, 0, 4, height)),
             "wall-y0": turned(upright(0, 4, 0, height, 0)), "wall-y1": upright(0, 4, 0, height, 4),
             "wall-x0": sideways(0, 4, 0, height, 0), "wall-x1": turned(sideways(0, 4, 0, height, 4))}
    return [(name, BLACK, corners) for name, corners in faces.items() if name not in without]


def values(points, find):
    return [find(position, normal) for _, position, normal in points]


def file_of(angles, candela, opening):
    """An LM-63 of one plane."""
    lines = [f"1 -1 1 {len(angles)} 1 1 2 {opening} {opening} 0", "1 1 10", " ".join(f"{x:g}" for x in angles), "0",
             *(f"{x:.7g}" for x in candela)]
    return POINT + "\n".join(lines) + "\n"


def diffuse_file(opening):
    """1000 cos(gamma) cd, every degree: 3,141.51 of 3,141.59 lm, as values between are linear."""
    angles = np.arange(91)
    candela = 1000 * np.cos(np.radians(angles))
    candela[-1] = 0
    return file_of(angles, candela, opening)


def isotropic_file():
    angles = np.arange(0, 181, 5)
    return file_of(angles, np.full(angles.size, ISOTROPIC_LUMENS / (4 * math.pi)), 0)


def point_source():
    """5.2: E = I h^2 / d^4, I = 1000 cd."""
    places = dict(A=(0, 0), B=(.5, 0), C=(1, 0), D=(1.5, 0), E=(.5, .5), F=(1, .5), G=(1.5, .5), H=(1, 1), I=(1.5, 1),
                  J=(1.5, 1.5))
    points = [(name, vector(x, y, 0), vector(0, 0, 1)) for name, (x, y) in places.items()]
    expected = [1000 * 9 / (position @ position + 9) ** 2 for _, position, _ in points]
    return Scene([("floor", BLACK, flat(-2, 2, -2, 2, 0))], [Case("5.2", "point source", "lx", expected)], points,
                 luminaire=(diffuse_file(0), (0, 0, 3)))


def area_source(as_file):
    """5.3: E = pi L C."""
    source = turned(flat(1.5, 2.5, 1.5, 2.5, 3))
    points = wall_points() + floor_points()
    expected = values(points, lambda p, n: math.pi * RADIANCE * configuration_factor(p, n, source))
    if as_file:
        return Scene(room(), [Case("5.3", "area source, a luminaire", "lx", expected)], points,
                     luminaire=(diffuse_file(1), (2, 2, 3)))
    faces = room(without=("ceiling",)) + [("ceiling", BLACK, turned(flat(*part, 3))) for part in frame(1.5, 2.5, 1.5, 2.5)]
    return Scene([*faces, ("source", LIT, source)], [Case("5.3", "area source, a face", "lx", expected)], points,
                 emission=math.pi * RADIANCE, options=("--lights", "lm"))


def conservation():
    """5.4: all lumens arrive."""
    return Scene(room(), [Case("5.4", "flux conservation", "lm", [float(ISOTROPIC_LUMENS)])], [],
                 luminaire=(isotropic_file(), (2, 2, 1.5)), answer="lumens")


def bounce(size):
    """5.6: of a floor that is lit evenly, E / (E_hz rho) = C."""
    half = size / 2
    source = flat(2 - half, 2 + half, 2 - half, 2 + half, 0)
    # The names of wall points run upwards here.
    points = [(name, vector(2, 0, z), vector(0, 1, 0)) for name, z in zip("BCDEF", (.75, 1.25, 1.75, 2.25, 2.75))]
    points += ceiling_points()
    expected = values(points, lambda p, n: 100 * configuration_factor(p, n, source))
    # A wall at y = 0 would hide a part of a large floor from the ceiling, which the case does not have.
    faces = [("source", LIT, source), ("ceiling", BLACK, turned(flat(0, 4, 0, 4, 3)))]
    return Scene(faces, [Case("5.6", f"reflection of {size:g} x {size:g} m", "%", expected)], points, emission=100)


def obstruction():
    """5.7: of a wall that is lit evenly, past a box; E / (E_v rho) = C of the part that is seen. All points have x = 2, so that
    the box is as wide as the rays are, and the height of a ray over it is linear in y."""
    points = wall_points() + floor_points("GHIJK")

    def seen(point, normal):
        if point[1] >= 2.5:
            return 0.
        least = max(0, *(point[2] + (1 - point[2]) * (4 - point[1]) / (y - point[1]) for y in (2.5, 2.7)))
        return 100 * configuration_factor(point, normal, upright(0, 4, least, 3, 4)) if least < 3 else 0.
    faces = [("source", LIT, upright(0, 4, 0, 3, 4)), ("wall", BLACK, turned(upright(0, 4, 0, 3, 0))),
             ("floor", BLACK, flat(0, 4, 0, 2.5, 0)), ("box", BLACK, flat(0, 4, 2.5, 2.7, 1)),
             ("box", BLACK, upright(0, 4, 0, 1, 2.5)), ("box", BLACK, turned(upright(0, 4, 0, 1, 2.7))),
             ("box", BLACK, turned(sideways(2.5, 2.7, 0, 1, 0))), ("box", BLACK, sideways(2.5, 2.7, 0, 1, 4))]
    return Scene(faces, [Case("5.7", "reflection past a box", "%", values(points, seen))], points, emission=100)


def cube(reflectance):
    """5.8: the mean over all faces of a closed cube, by balance: Phi / A rho / (1 - rho)."""
    expected = ISOTROPIC_LUMENS / 96 * reflectance / (1 - reflectance)
    return Scene(room(4), [Case("5.8", f"cube, reflectance {reflectance:g}", "lx", [expected])], [], reflectance=reflectance,
                 luminaire=(isotropic_file(), (2, 2, 2)), answer="mean")


def roof(size, skies):
    """5.9: the sky through an opening of the roof, 60 degrees of sun above +y."""
    sun = vector(0, math.cos(SUN_ALTITUDE), math.sin(SUN_ALTITUDE))
    low, high = 2 - size / 2, 2 + size / 2
    points, opening = wall_points() + floor_points(), flat(low, high, low, high, 3)
    faces = room(without=("ceiling",)) + [("ceiling", BLACK, turned(flat(*part, 3))) for part in frame(low, high, low, high)]
    luminances, cases = [sky_luminance(kind, sun) for kind in skies], []
    for kind, light in zip(skies, luminances):
        outside = horizontal_illuminance(light)
        expected = values(points, lambda p, n, light=light: through(p, n, opening, light))
        cases.append(Case("5.9", f"roof {size:g} x {size:g} m, sky {kind}", "% of E_hz", [100 * x / outside for x in expected]))
    return Scene(faces, cases, points, sky=luminances)


def facade(width, skies):
    """5.11: sky and ground through an opening of the wall y = 0, 60 degrees of sun above -y. The ground has the even luminance
    .3 E_hz / pi."""
    sun = vector(0, -math.cos(SUN_ALTITUDE), math.sin(SUN_ALTITUDE))
    x0, x1, z0, z1 = (1, 3, 1, 2) if width == 2 else (0, 4, 0, 3)
    points = [(name, vector(2, 4, z), vector(0, -1, 0)) for name, z in WALL_HEIGHTS.items()]
    for mark, z, up in ("", 0, 1), ("'", 3, -1):
        points += [(name + mark, vector(2, 4 - y, z), vector(0, 0, up)) for name, y in DEPTHS.items()]
    faces = room(without=("wall-y0",)) + [("wall-y0", BLACK, turned(upright(*part, 0)))
                                          for part in ((0, 4, 0, z0), (0, 4, z1, 3), (0, x0, z0, z1), (x1, 4, z0, z1))
                                          if part[0] < part[1] and part[2] < part[3]]
    luminances, cases = [sky_luminance(kind, sun) for kind in skies], []
    for kind, light in zip(skies, luminances):
        outside = horizontal_illuminance(light)
        ground = GROUND_ALBEDO * outside / math.pi
        expected = values(points, lambda p, n, light=light, ground=ground:
                          through_facade(p, n, (x0, x1, z0, z1, 0), light, ground))
        cases.append(Case("5.11", f"facade {x1 - x0} x {z1 - z0} m, sky {kind}", "% of E_hz",
                          [100 * x / outside for x in expected]))
    return Scene(faces, cases, points, sky=luminances, options=("--ground-albedo", GROUND_ALBEDO))


def lamp_scenes(reflectances=REFLECTANCES, sizes=(.5, 4, 500)):
    yield point_source()
    yield area_source(False)
    yield area_source(True)
    yield conservation()
    for size in sizes:
        yield bounce(size)
    yield obstruction()
    for reflectance in reflectances:
        yield cube(reflectance)


def sky_scenes(skies=SKIES, small=False):
    yield roof(1, skies)
    yield facade(2, skies)
    if not small:
        yield roof(4, skies)
        yield facade(4, skies)
