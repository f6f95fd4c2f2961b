/* The mapping of linear values to display colours: exposure, tone curve, sRGB. Knows no scene. */
#ifndef LAMBERT_RENDER_TONE_H
#define LAMBERT_RENDER_TONE_H

#include "store/status.h"

/* Colours have red, green and blue. */
#define TONE_CHANNELS 3

/* The luminance of a sample: its only channel, the Rec. 709 luminance of 3, or the mean of more. */
float tone_luminance(const float *values, size_t n_channels);

/* A histogram of luminances on a logarithmic scale; starts as zero. */
#define TONE_BINS 2048
typedef struct tone_histogram {
    size_t counts[TONE_BINS];
    size_t total;
} tone_histogram;

void tone_histogram_add(tone_histogram *h, float luminance);

/* The quantile of the luminances at share (0 to 1), to 3 %; 0 where none is above 0. */
double tone_histogram_quantile(const tone_histogram *h, double share);

/* The exposure: the factor by which these luminances fit a screen whose white is 1. */
double tone_exposure(const tone_histogram *h);

/* Display-linear brightness of an exposed value: x itself up to the knee, then a shoulder towards 1. */
float tone_curve(float x);

/* The tone curve of a colour, in place: the largest channel follows tone_curve and the hue stays, but
 * desaturates the more the colour exceeds the screen. */
void tone_color(float rgb[3]);

/* The sRGB code (0 to 255) of a display-linear value. */
unsigned char tone_encode(float linear);

/* The display-linear value of an sRGB one. */
float tone_decode(float encoded);

#endif
