/* False colour: palettes, the scale from values to their colours, and the numbers beside it. Knows no scene.
 */
#ifndef LAMBERT_RENDER_PALETTE_H
#define LAMBERT_RENDER_PALETTE_H

#include "store/status.h"

/* The names of the palettes, as options list them; the first is the preset. They are those of
 * d3-scale-chromatic, which browsers draw with: 33 samples of each, linear between, differ from it by at most
 * 4 of 255. viridis and inferno are by van der Walt and Smith (matplotlib, CC0), turbo is by Mikhailov
 * (2019).
 */
#define PALETTE_NAMES "viridis|inferno|turbo"

typedef struct palette palette;

/* NULL where there is none of this name. */
const palette *palette_find(const char *name);

/* The sRGB colour (0 to 1) at t, which is brought within [0, 1]. */
void palette_color(const palette *p, float t, float rgb[3]);

/* Values from low to high as colours of a palette, evenly or, with logarithmic, by their logarithms; then
 * 0 < low. high > low of every scale in use, by a ten-thousandth of high or more; a zeroed
 * one is none. */
typedef struct color_scale {
    const palette *palette;
    double low, high;
    bool logarithmic;
} color_scale;

/* The place of a value: 0 at low, 1 at high, beyond them outside of [0, 1]; -INFINITY of the logarithm of 0.
 */
double color_scale_place(const color_scale *s, double value);

/* The numbers beside a scale, rising, at most COLOR_SCALE_TICKS: multiples within it of 1, 2 or 5 times a
 * power of ten, about 5; of a logarithmic scale over a decade or more the powers of ten, with their doubles
 * and fivefolds as far as these are few. Returns how many. */
#define COLOR_SCALE_TICKS 16
size_t color_scale_ticks(const color_scale *s, double ticks[COLOR_SCALE_TICKS]);

#endif
