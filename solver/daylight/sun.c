#include "solver/daylight/sun.h"

#include <math.h>

#define DEGREE (M_PI / 180)

/* Days from noon of 1 January 2000 to the midnight at which a day begins. Years are counted from March, so
 * that a leap day is the last day; five months of 31, 30, 31, 30 and 31 days have 153. */
static double days_since_2000(int year, int month, int day) {
    const long back = month <= 2, y = year - back, m = month - 3 + 12 * back;
    const long days = 365 * y + y / 4 - y / 100 + y / 400 + (153 * m + 2) / 5 + day;
    return (double)(days - 730426) - .5;
}

sun_position sun_at(double latitude, double longitude, double time_zone, int year, int month, int day,
                    double hour) {
    const double ut = hour - time_zone;
    const double n = days_since_2000(year, month, day) + ut / 24;
    /* Mean longitude L, mean anomaly g, ecliptic longitude l, obliquity of the ecliptic e. */
    const double L = 280.460 + .9856474 * n, g = (357.528 + .9856003 * n) * DEGREE;
    const double l = (L + 1.915 * sin(g) + .020 * sin(2 * g)) * DEGREE, e = (23.439 - 4e-7 * n) * DEGREE;
    const double ascension = atan2(cos(e) * sin(l), cos(l)), declination = asin(sin(e) * sin(l));
    /* Sidereal time, in hours at Greenwich, in radians here. */
    const double sidereal = ((6.697375 + .0657098242 * n + ut) * 15 + longitude) * DEGREE;
    const double h = sidereal - ascension, phi = latitude * DEGREE;
    sun_position s = {.distance = 1.00014 - .01671 * cos(g) - .00014 * cos(2 * g)};
    s.direction[0] = -cos(declination) * sin(h);
    s.direction[1] = sin(declination) * cos(phi) - cos(declination) * sin(phi) * cos(h);
    s.direction[2] = sin(declination) * sin(phi) + cos(declination) * cos(phi) * cos(h);
    s.altitude = atan2(s.direction[2], hypot(s.direction[0], s.direction[1]));
    s.azimuth = atan2(s.direction[0], s.direction[1]);
    return s;
}

sun_position sun_of_angles(double azimuth, double altitude) {
    const double a = remainder(azimuth, 360) * DEGREE, h = altitude * DEGREE;
    return (sun_position){
        .altitude = h, .azimuth = a, .direction = {sin(a) * cos(h), cos(a) * cos(h), sin(h)}, .distance = 1};
}

sun_position sun_turned(sun_position s, double north) {
    /* Without a turn the bits stay. */
    if (north == 0) return s;
    const double turn = north * DEGREE, east = s.direction[0], ahead = s.direction[1];
    s.azimuth = remainder(s.azimuth + turn, 2 * M_PI);
    s.direction[0] = east * cos(turn) + ahead * sin(turn);
    s.direction[1] = ahead * cos(turn) - east * sin(turn);
    return s;
}
