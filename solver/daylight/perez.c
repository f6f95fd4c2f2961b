#include "solver/daylight/perez.h"

#include <math.h>

enum { BINS = 8 };

/* Clearness where bins 2 to 8 begin (1990, table 1). */
static const double bin_from[BINS - 1] = {1.065, 1.230, 1.500, 1.950, 2.800, 4.500, 6.200};

/* 1993, table 1: x1 ... x4 of a, b, c, d, e for each bin. */
static const double shape[BINS][5][4] = {
    {{1.3525, -.2576, -.2690, -1.4366},
     {-.7670, .0007, 1.2734, -.1233},
     {2.8000, .6004, 1.2375, 1.0000},
     {1.8734, .6297, .9738, .2809},
     {.0356, -.1246, -.5718, .9938}},
    {{-1.2219, -.7730, 1.4148, 1.1016},
     {-.2054, .0367, -3.9128, .9156},
     {6.9750, .1774, 6.4477, -.1239},
     {-1.5798, -.5081, -1.7812, .1080},
     {.2624, .0672, -.2190, -.4285}},
    {{-1.1000, -.2515, .8952, .0156},
     {.2782, -.1812, -4.5000, 1.1766},
     {24.7219, -13.0812, -37.7000, 34.8438},
     {-5.0000, 1.5218, 3.9229, -2.6204},
     {-.0156, .1597, .4199, -.5562}},
    {{-.5484, -.6654, -.2672, .7117},
     {.7234, -.6219, -5.6812, 2.6297},
     {33.3389, -18.3000, -62.2500, 52.0781},
     {-3.5000, .0016, 1.1477, .1062},
     {.4659, -.3296, -.0876, -.0329}},
    {{-.6000, -.3566, -2.5000, 2.3250},
     {.2937, .0496, -5.6812, 1.8415},
     {21.0000, -4.7656, -21.5906, 7.2492},
     {-3.5000, -.1554, 1.4062, .3988},
     {.0032, .0766, -.0656, -.1294}},
    {{-1.0156, -.3670, 1.0078, 1.4051},
     {.2875, -.5328, -3.8500, 3.3750},
     {14.0000, -.9999, -7.1406, 7.5469},
     {-3.4000, -.1078, -1.0750, 1.5702},
     {-.0672, .4016, .3017, -.4844}},
    {{-1.0000, .0211, .5025, -.5119},
     {-.3000, .1922, .7023, -1.6317},
     {19.0000, -5.0000, 1.2438, -1.9094},
     {-4.0000, .0250, .3844, .2656},
     {1.0468, -.3788, -2.4517, 1.4656}},
    {{-1.0500, .0289, .4260, .3590},
     {-.3250, .1156, .7781, .0025},
     {31.0625, -14.5000, -46.1148, 55.3750},
     {-7.2312, .4050, 13.3500, .6234},
     {1.5000, -.6426, 1.8564, .5636}},
};

/* 1990, table 4: a, b, c, d of the luminous efficacy of diffuse and of direct light. */
static const double diffuse_efficacy[BINS][4] = {
    {97.24, -.46, 12.00, -8.91},    {107.22, 1.15, .59, -3.95},     {104.97, 2.96, -5.53, -8.77},
    {102.39, 5.59, -13.95, -13.90}, {100.71, 5.94, -22.75, -23.74}, {106.42, 3.83, -36.15, -28.83},
    {141.88, 1.90, -53.24, -14.03}, {152.23, .35, -45.27, -7.98}};
static const double direct_efficacy[BINS][4] = {{57.20, -4.55, -2.98, 117.12}, {98.99, -3.46, -1.21, 12.38},
                                                {109.83, -4.90, -1.71, -8.81}, {110.34, -5.84, -1.99, -4.56},
                                                {106.36, -3.97, -1.75, -6.16}, {107.19, -1.25, -1.51, -26.73},
                                                {105.75, .77, -1.26, -34.44},  {101.18, 1.58, -1.10, -8.29}};

double perez_air_mass(double zenith) {
    return 1 / (cos(zenith) + .15 * pow(93.885 - zenith * 180 / M_PI, -1.253));
}

perez_sky perez_sky_of(const sun_position *sun, double direct, double diffuse) {
    const double z = fmin(M_PI / 2 - sun->altitude, M_PI / 2), cube = 1.041 * z * z * z;
    const double extraterrestrial = PEREZ_SOLAR / (sun->distance * sun->distance);
    perez_sky p = {.zenith = z, .clearness = INFINITY};
    if (diffuse > 0) p.clearness = ((diffuse + direct) / diffuse + cube) / (1 + cube);
    p.brightness = fmin(fmax(diffuse * perez_air_mass(z) / extraterrestrial, .01), .6);
    while (p.bin < BINS - 1 && p.clearness >= bin_from[p.bin]) p.bin++;
    /* In bins 2 to 5 the luminance of the horizon is unbounded below a brightness of .2. We take .2 there, as
     * Radiance's gendaylit and gendaymtx do. */
    const double Delta = p.bin >= 1 && p.bin <= 4 ? fmax(p.brightness, .2) : p.brightness;
    double x[5];
    const double(*const k)[4] = shape[p.bin];
    for (int i = 0; i < 5; i++) x[i] = k[i][0] + k[i][1] * z + Delta * (k[i][2] + k[i][3] * z);
    if (p.bin == 0) { /* eq. 7 and 8 */
        x[2] = exp(pow(Delta * (k[2][0] + k[2][1] * z), k[2][2])) - k[2][3];
        x[3] = -exp(Delta * (k[3][0] + k[3][1] * z)) + k[3][2] + Delta * k[3][3];
    }
    p.a = x[0];
    p.b = fmin(x[1], 0); /* b > 0, of bright clear skies, would make the horizon unbounded too */
    p.c = x[2];
    p.d = x[3];
    p.e = x[4];
    return p;
}

double perez_gradation(const perez_sky *p, double cos_zeta) {
    return fmax(1 + p->a * exp(p->b / cos_zeta), 0);
}

double perez_scattering(const perez_sky *p, double cos_gamma) {
    const double gamma = acos(fmin(fmax(cos_gamma, -1), 1));
    return fmax(1 + p->c * exp(p->d * gamma) + p->e * cos_gamma * cos_gamma, 0);
}

double perez_water(double dew_point) {
    return isnan(dew_point) ? PEREZ_WATER : exp(.07 * dew_point - .075);
}

double perez_diffuse_efficacy(const perez_sky *p, double water) {
    const double *k = diffuse_efficacy[p->bin];
    return fmax(k[0] + k[1] * water + k[2] * cos(p->zenith) + k[3] * log(p->brightness), 0);
}

double perez_direct_efficacy(const perez_sky *p, double water) {
    const double *k = direct_efficacy[p->bin];
    return fmax(k[0] + k[1] * water + k[2] * exp(5.73 * p->zenith - 5) + k[3] * p->brightness, 0);
}
