"""Rooms of CIE 190 for UGR: luminaires .25 H apart in the plane of the ceiling, H = 2 m above the eye, which is as high as the
floor and in the middle of a wall. A room of X by Y is X wide as the eye sees it and Y long."""
import csv
import json
import os
import pathlib

FIXTURES = pathlib.Path(os.environ.get("FIXTURES", pathlib.Path(__file__).resolve().parent.parent / "fixtures")) / "luminaires"
H = 2
SPACING = .25 * H
ROOMS = [(x, y) for x, lengths in ((2, (2, 3, 4, 6, 8, 12)), (4, (2, 3, 4, 6, 8, 12)), (8, (4, 6, 8, 12)), (12, (4, 6, 8)))
         for y in lengths]
REFLECTANCES = [(.7, .5, .2), (.7, .3, .2), (.5, .5, .2), (.5, .3, .2), (.3, .3, .2)]  # of ceiling, walls and floor
VIEWS = ("across", "along")  # the lamps
UPWARDS = {"09": .05}  # metres below the ceiling of luminaires with light upwards, which tables let fall on the ceiling
ROUND = ("09",)  # the same across and along


def table(sample):
    """{((x, y), reflectances, view): UGR by Relux}"""
    with open(FIXTURES / "ugr" / f"ugr_table_{sample}_Relux.csv", encoding="utf-8") as file:
        rows = [[float(cell) for cell in row] for row in csv.reader(file)]
    return {(room, reflectances, view): rows[r][5 * v + k] for r, room in enumerate(ROOMS)
            for k, reflectances in enumerate(REFLECTANCES) for v, view in enumerate(VIEWS)}


def write_room(path, x, y, height, reflectances):
    """A box of x by y by height metres as OBJ, beside its MTL; faces look inwards."""
    path = pathlib.Path(path)
    names = ("ceiling", "walls", "floor")
    path.with_suffix(".mtl").write_text("".join(f"newmtl {name}\nKd {rho} {rho} {rho}\n" for name, rho in zip(names, reflectances)),
                                        encoding="utf-8")
    corners = [(a, b, c) for c in (0, height) for a, b in ((0, 0), (x, 0), (x, y), (0, y))]
    faces = {"floor": ["1 2 3 4"], "ceiling": ["5 8 7 6"], "walls": ["1 5 6 2", "2 6 7 3", "3 7 8 4", "4 8 5 1"]}
    path.write_text(f"mtllib {path.with_suffix('.mtl').name}\n" + "".join("v %g %g %g\n" % corner for corner in corners) +
                    "".join(f"g {name}\nusemtl {name}\n" + "".join(f"f {face}\n" for face in some) for name, some in faces.items()),
                    encoding="utf-8")


def eyes_of(run, folder, sample, room, reflectances, elements=400):
    """The answers at both eyes of a floor of room[0] by room[1] H whose lamps lie along y: {(room as seen, view): eye}. run is
    called with the words of a command line and returns its standard output."""
    x, y = room[0] * H, room[1] * H
    scene, lights, sensors, made = (str(pathlib.Path(folder) / name) for name in ("room.obj", "lights.json", "eyes.json", "room.h5"))
    write_room(scene, x, y, H + UPWARDS.get(sample, 0), reflectances)
    lamps = {"name": "lamp", "file": f"eulumdat-ugr-sample_{sample}.ldt", "from": [SPACING / 2, SPACING / 2, H],
             "steps": [[SPACING, 0, 0], [0, SPACING, 0]], "counts": [round(x / SPACING), round(y / SPACING)], "c0": [1, 0, 0]}
    # The length of an EULUMDAT lies along C90, here y: an eye that looks along x looks across the lamps.
    eyes = [{"name": "along", "at": [x / 2, 0, 0], "view": [0, 1, 0]}, {"name": "across", "at": [0, y / 2, 0], "view": [1, 0, 0]}]
    for path, value in ((lights, {"luminaires": [lamps]}), (sensors, {"eyes": eyes})):
        pathlib.Path(path).write_text(json.dumps(value), encoding="utf-8")
    run("precompute", scene, "--luminaires", lights, "--assets", FIXTURES / "real", "--sensors", sensors, "--elements", elements, "--fix",
        "--probes", 0, "-o", made)
    sets = json.loads(run("solve", made, "--sensors", "all", "--json"))["sensors"]
    return {(room if one["name"] == "along" else room[::-1], one["name"]): one["eyes"][0] for one in sets}
