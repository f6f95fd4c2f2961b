#include "solver/render/palette.h"

#include <math.h>
#include <string.h>

enum { STEPS = 32 };

struct palette {
    const char *name;
    uint32_t colors[STEPS + 1]; /* 0xRRGGBB, sRGB */
};

static const palette palettes[] = {
    {"viridis", {0x440154, 0x470d60, 0x48186a, 0x482374, 0x472d7b, 0x453781, 0x424086, 0x3e4989, 0x3b528b,
                 0x375b8d, 0x33638d, 0x2f6b8e, 0x2c728e, 0x297a8e, 0x26828e, 0x23898e, 0x21908c, 0x1f978b,
                 0x1f9f88, 0x21a685, 0x27ad81, 0x31b57b, 0x3ebc74, 0x4dc26c, 0x5cc863, 0x6ece58, 0x82d34d,
                 0x95d840, 0xaadc32, 0xc0df25, 0xd5e21a, 0xeae51a, 0xfde725}},
    {"inferno", {0x000004, 0x040312, 0x0b0724, 0x150b37, 0x210c4a, 0x2f0a5b, 0x3d0965, 0x4a0c6b, 0x56106e,
                 0x63156e, 0x70196e, 0x7d1e6d, 0x89226a, 0x962766, 0xa32c61, 0xaf315b, 0xbb3654, 0xc63d4d,
                 0xd14545, 0xda4f3c, 0xe35932, 0xeb6529, 0xf1721e, 0xf67f14, 0xf98c0a, 0xfb9b06, 0xfcaa0f,
                 0xfbba1f, 0xf9c932, 0xf5d949, 0xf2e865, 0xf3f586, 0xfcffa4}},
    {"turbo", {0x23171b, 0x3e2a72, 0x493eaf, 0x4a54d7, 0x446aee, 0x3c80f8, 0x3295f7, 0x2aa9ef, 0x26bce2,
               0x25cdd0, 0x29dcbc, 0x32e9a7, 0x3ff393, 0x50fa80, 0x65fd6e, 0x7dfd5e, 0x94fa50, 0xadf545,
               0xc4ec3c, 0xdae034, 0xedd12e, 0xfabf29, 0xffac25, 0xff9821, 0xff821d, 0xfd6c1a, 0xf05616,
               0xdf4212, 0xcb2f0d, 0xb61f07, 0xa31302, 0x950c00, 0x900c00}},
};

const palette *palette_find(const char *name) {
    for (size_t k = 0; k < sizeof palettes / sizeof *palettes; k++)
        if (strcmp(palettes[k].name, name) == 0) return &palettes[k];
    return NULL;
}

void palette_color(const palette *p, float t, float rgb[3]) {
    const float place = (t > 0 ? fminf(t, 1) : 0) * STEPS;
    const int below = place >= STEPS ? STEPS - 1 : (int)place;
    const float share = place - (float)below;
    for (int c = 0; c < 3; c++) {
        const int shift = 16 - 8 * c;
        const float from = (float)(p->colors[below] >> shift & 255u);
        const float to = (float)(p->colors[below + 1] >> shift & 255u);
        rgb[c] = ((1 - share) * from + share * to) / 255;
    }
}

double color_scale_place(const color_scale *s, double value) {
    if (!s->logarithmic) return (value - s->low) / (s->high - s->low);
    if (!(value > 0)) return -INFINITY;
    return log(value / s->low) / log(s->high / s->low);
}

/* A number is on the scale also where rounding has moved it beyond an end. */
static const double slack = 1e-9;

static size_t even_ticks(const color_scale *s, double *ticks) {
    static const double steps[] = {1, 2, 5, 10};
    const double about = (s->high - s->low) / 5, unit = pow(10, floor(log10(about)));
    size_t n = 0, k = 0;
    /* The step nearest to a fifth of the scale by its logarithm, which d3-array's ticks(low, high, 5) takes
     * too. */
    while (k < 3 && steps[k] * steps[k + 1] * unit * unit < about * about) k++;
    const double step = steps[k] * unit;
    for (double i = ceil(s->low / step - slack); i * step <= s->high + slack * step; i++)
        if (n < COLOR_SCALE_TICKS) ticks[n++] = i * step + 0.; /* never -0 */
    return n;
}

static size_t decade_ticks(const color_scale *s, const double *digits, size_t n_digits, double *ticks) {
    size_t n = 0;
    for (double power = floor(log10(s->low) - slack); power <= log10(s->high) + slack; power++)
        for (size_t d = 0; d < n_digits; d++) {
            const double tick = digits[d] * pow(10, power);
            if (tick < s->low * (1 - slack) || tick > s->high * (1 + slack)) continue;
            if (n < COLOR_SCALE_TICKS) ticks[n++] = tick;
        }
    return n;
}

size_t color_scale_ticks(const color_scale *s, double ticks[COLOR_SCALE_TICKS]) {
    static const double digits[] = {1, 2, 5};
    const double decades = s->logarithmic ? log10(s->high / s->low) : 0;
    if (decades < 1) return even_ticks(s, ticks);
    return decade_ticks(s, digits, decades <= 3.5 ? 3 : 1, ticks);
}
