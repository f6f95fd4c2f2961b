#include "solver/render/tone.h"

#include "solver/base/photometry.h"

#include <math.h>

/* Bins of luminances from 2^LOWEST on, BINS_PER_OCTAVE for each octave; bin 0 holds all darker ones. */
#define LOWEST (-48)
#define BINS_PER_OCTAVE 20

/* Where the curve leaves the diagonal. */
#define KNEE 0.7f

/* A colour this many times brighter than the screen has lost most of its hue. */
#define WHITENING 6.0f

float tone_luminance(const float *values, size_t n_channels) {
    if (n_channels == 1) return values[0];
    if (n_channels == 3)
        return (float)LUMINANCE_RED * values[0] + (float)LUMINANCE_GREEN * values[1] +
               (float)LUMINANCE_BLUE * values[2];
    float sum = 0;
    for (size_t c = 0; c < n_channels; c++) sum += values[c];
    return sum / (float)n_channels;
}

void tone_histogram_add(tone_histogram *h, float luminance) {
    double bin = luminance > 0 ? (log2((double)luminance) - LOWEST) * BINS_PER_OCTAVE : 0;
    h->counts[bin < 0 ? 0 : bin >= TONE_BINS ? TONE_BINS - 1 : (size_t)bin]++;
    h->total++;
}

double tone_histogram_quantile(const tone_histogram *h, double share) {
    double below = 0;
    for (size_t bin = 0; bin < TONE_BINS; bin++) {
        below += (double)h->counts[bin];
        if (h->counts[bin] > 0 && below >= share * (double)h->total)
            return bin == 0 ? 0 : exp2(LOWEST + ((double)bin + .5) / BINS_PER_OCTAVE);
    }
    return 0;
}

double tone_exposure(const tone_histogram *h) {
    /* The 95 % quantile just reaches the shoulder of the curve. Where the median is then darker than .18, the
     * exposure is raised half of the way (geometrically), at most fourfold, and bright parts move into the
     * shoulder. */
    const double bright = tone_histogram_quantile(h, .95), middle = tone_histogram_quantile(h, .5);
    if (!(bright > 0)) return 1;
    const double for_bright = .75 / bright;
    if (!(middle > 0) || .18 / middle <= for_bright) return for_bright;
    return fmin(sqrt(for_bright * .18 / middle), 4 * for_bright);
}

float tone_curve(float x) {
    if (!(x > 0)) return 0;
    if (x <= KNEE) return x;
    return 1 - (1 - KNEE) * expf(-(x - KNEE) / (1 - KNEE));
}

void tone_color(float rgb[3]) {
    const float largest = fmaxf(rgb[0], fmaxf(rgb[1], rgb[2]));
    if (!(largest > KNEE)) {
        for (int c = 0; c < 3; c++) rgb[c] = fmaxf(rgb[c], 0);
        return;
    }
    const float excess = (largest - KNEE) / WHITENING;
    const float shown = tone_curve(largest), white = 1 - expf(-excess * excess);
    for (int c = 0; c < 3; c++) rgb[c] = shown * ((1 - white) * fmaxf(rgb[c], 0) / largest + white);
}

unsigned char tone_encode(float linear) {
    /* IEC 61966-2-1 */
    float x = linear > 0 ? fminf(linear, 1) : 0;
    float encoded = x <= 0.0031308f ? 12.92f * x : 1.055f * powf(x, 1 / 2.4f) - 0.055f;
    return (unsigned char)(255 * encoded + .5f);
}

float tone_decode(float encoded) {
    return encoded <= 0.04045f ? encoded / 12.92f : powf((encoded + 0.055f) / 1.055f, 2.4f);
}
