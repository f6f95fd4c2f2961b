/* The position of the sun. Knows nothing of weather. */
#ifndef LAMBERT_DAYLIGHT_SUN_H
#define LAMBERT_DAYLIGHT_SUN_H

typedef struct sun_position {
    double altitude;     /* radians; below 0: night */
    double azimuth;      /* radians from north by east, -pi to pi */
    double direction[3]; /* unit vector: east, north, up */
    double distance;     /* from the earth, astronomical units */
} sun_position;

/* The position at an hour of standard time (0 to 24, decimal), time_zone hours ahead of UTC, of a day of the
 * Gregorian calendar, at a latitude and longitude in degrees (north and east positive). It is accurate to .01
 * degrees from 1950 to 2050. It omits refraction, which lifts the sun by .57 degrees at the horizon and by
 * less than .1 above an altitude of 10 degrees. Source: the low-precision formulas of the Astronomical
 * Almanac, as in Michalsky 1988, Solar Energy 40(3):227-235. */
sun_position sun_at(double latitude, double longitude, double time_zone, int year, int month, int day,
                    double hour);

/* A position by its azimuth from north by east and its altitude, in degrees, one astronomical unit away. */
sun_position sun_of_angles(double azimuth, double altitude);

/* The position in a model whose north is `north` degrees from its +y (z up) or -z (y up), by east as azimuths
 * are: at 90 north is +x. The azimuth grows by that; its sky goes with it. */
sun_position sun_turned(sun_position s, double north);

#endif
