/* Linear values to what a screen shows: exposure, tone curve, sRGB, false colour. Knows no scene. */
#ifndef LAMBERT_RENDER_TONE_H
#define LAMBERT_RENDER_TONE_H

#include "store/status.h"

/* One brightness for a sample of 1 channel (itself), 3 (Rec. 709 luminance) or more (their mean). */
float tone_luminance(const float *values, size_t n_channels);

/* The values that pictures are judged by, gathered pixel by pixel; zeroed to begin with. */
#define TONE_BINS 2048
typedef struct tone_histogram {
    size_t counts[TONE_BINS];
    size_t total;
} tone_histogram;

void tone_histogram_add(tone_histogram *h, float luminance);

/* The value that this share (0 to 1) of what was added stays below, to 3 %; 0 when nothing is above 0. */
double tone_histogram_quantile(const tone_histogram *h, double share);

/* The factor that makes a scene of these values fit a screen whose white is 1. */
double tone_exposure(const tone_histogram *h);

/* Display-linear brightness of an exposed value: x itself up to the knee, then a shoulder towards 1. */
float tone_curve(float x);

/* The same for a colour, in place: its largest channel follows the curve and its hue stays, but the more it
 * exceeds the screen the whiter it is. */
void tone_color(float rgb[3]);

/* The sRGB code (0 to 255) of a display-linear value. */
unsigned char tone_encode(float linear);

/* Dark blue over green to yellow, lightness rising evenly: the sRGB colour (0 to 1) of t in [0, 1]. */
void tone_false_color(float t, float rgb[3]);

/* The display-linear value of an sRGB one. */
float tone_decode(float encoded);

#endif
