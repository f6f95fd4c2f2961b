"""Weather files of a made-up year, and where the sun stood."""

import datetime
import math

import numpy as np

LATITUDE, LONGITUDE, ZONE = 37.5, -122.25, -8
DAYS = (31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31)


def sun(year, month, day, hour, place=(LATITUDE, LONGITUDE, ZONE)):
    """East, north and up of the sun over a place, by the formulas of Meeus, Astronomical Algorithms, ch. 25 and 28 (low accuracy,
    good to .01 degrees), which are not those of the program."""
    latitude, longitude, zone = place
    days = (datetime.date(year, month, day) - datetime.date(2000, 1, 1)).days - .5 + (hour - zone) / 24
    T = days / 36525
    L, M = math.radians(280.46646 + 36000.76983 * T), math.radians(357.52911 + 35999.05029 * T - .0001537 * T * T)
    centre = ((1.914602 - .004817 * T) * math.sin(M) + (.019993 - .000101 * T) * math.sin(2 * M)
              + .000289 * math.sin(3 * M))
    node = math.radians(125.04 - 1934.136 * T)
    along = L + math.radians(centre - .00569 - .00478 * math.sin(node))
    tilt = math.radians(23.439291 - .0130042 * T + .00256 * math.cos(node))
    declination = math.asin(math.sin(tilt) * math.sin(along))
    y, e = math.tan(tilt / 2) ** 2, .016708634 - .000042037 * T
    equation = (y * math.sin(2 * L) - 2 * e * math.sin(M) + 4 * e * y * math.sin(M) * math.cos(2 * L)
                - y * y / 2 * math.sin(4 * L) - 1.25 * e * e * math.sin(2 * M))
    turn = math.radians(15 * (hour - 12) + longitude - 15 * zone) + equation
    phi = math.radians(latitude)
    return (-math.cos(declination) * math.sin(turn),
            math.sin(declination) * math.cos(phi) - math.cos(declination) * math.sin(phi) * math.cos(turn),
            math.sin(phi) * math.sin(declination) + math.cos(phi) * math.cos(declination) * math.cos(turn))


def sine_of_altitude(year, month, day, hour):
    return sun(year, month, day, hour)[2]


def a_year():
    """(month, day, hour, direct, diffuse) of a made-up year, every hour: clear, broken and overcast by turns."""
    rng = np.random.default_rng(11)
    for month in range(1, 13):
        for day in range(1, DAYS[month - 1] + 1):
            cloud = rng.random()
            for hour in range(24):
                up = max(0, sine_of_altitude(2001, month, day, hour + .5))
                clear = 950 * up ** .3 if up > .02 else 0
                yield (month, day, hour + .5, round(clear * max(0, 1 - 1.6 * cloud)),
                       round(up * (90 + 350 * cloud * (1 - .6 * cloud))))


def wea(hours, latitude=LATITUDE, longitude=-LONGITUDE, zone=-15 * ZONE, units=1):
    head = (f"place Somewhere_XX\nlatitude {latitude}\nlongitude {longitude}\ntime_zone {zone}\nsite_elevation 2.0\n"
            f"weather_data_file_units {units}\n")
    return head + "".join(f"{m} {d} {h:.3f} {direct} {diffuse}\n" for m, d, h, direct, diffuse in hours)


def epw(hours, dew=99.9, step=1, periods=" 1/ 1,12/31", stated=1):
    """Rows of `step` hours by their middles; parts of an hour are named by the minute at which they end."""
    head = (f"LOCATION,Somewhere,XX,USA,TMY3,0,{LATITUDE},{LONGITUDE},{ZONE},2.0\nDESIGN CONDITIONS,0\n"
            "TYPICAL/EXTREME PERIODS,0\nGROUND TEMPERATURES,0\nHOLIDAYS/DAYLIGHT SAVINGS,No,0,0,0\nCOMMENTS 1,\n"
            f"COMMENTS 2,\nDATA PERIODS,1,{stated},Data,Sunday,{periods}\n")
    return head + "".join(f"2001,{m},{d},{int(h) + 1},{round(60 * (h % 1 + step / 2)) % 60 or 60 * (step < 1)},?,15.0,{dew},60,"
                          f"101300,0,0,300,0,{direct},{diffuse},0,0,0,0\n" for m, d, h, direct, diffuse in hours)


def parts(hours, n):
    """Rows of 1/n h with the values of their hours."""
    return [(m, d, h - .5 + (k + .5) / n, *light) for m, d, h, *light in hours for k in range(n)]
