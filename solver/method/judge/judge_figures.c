#include "solver/method/judge/judge_figures.h"

#include <math.h>

/* Indirect light below this share of all light counts as none: no ray found what the element sees, and the
 * rest is the remainder of the reference's iteration. */
static const double dark = 1e-6;
/* Noise below this share of a figure of receivers may be taken out of it. */
static const double noise_most = 1. / 3;

figure_number figure_number_at(const figure_probe *p, size_t k) {
    const double x = p->x[k], y = p->y != NULL ? p->y[k] : x;
    figure_number one = {.off = x};
    if (p->relation == REFERENCE_TWIN) one.off = .5 * (x + y), one.noise = .5 * (x - y);
    if (p->relation == REFERENCE_DISTURBED) one.noise = y - x;
    if (p->relation == REFERENCE_COARSER) one.apart = p->other_share * (x - y);
    const bool black = p->black != NULL && p->black[k % p->problem->n];
    const double rho = black ? 1 : (double)p->problem->reflectance[k];
    const float *direct = black ? p->direct : p->E;
    if (p->spread != NULL) one.light = rho * p->spread[k];
    if (p->noise != NULL) one.light += p->noise[k];
    one.b = (double)p->B[k] + one.off;
    one.bounced = one.b - (direct != NULL ? (double)direct[k] : 0);
    return one;
}

/* The same for figures of the whole scene, or of what is read of it: the irradiance of black elements counts
 * where it is all that there is, and else their radiosity, which is E. */
static figure_number number_of(const figure_probe *p, size_t k) {
    if (p->black != NULL && p->black[k % p->problem->n] && !p->all_black)
        return (figure_number){.b = (double)p->E[k]};
    return figure_number_at(p, k);
}

/* Squares, area-weighted, channels stacked. */
typedef struct squares {
    double b, bounced, off, noise, apart;
} squares;

/* read [n]: weights beside the area; NULL: 1. */
static squares squares_of(const figure_probe *p, const float *read) {
    const size_t n = p->problem->n, C = p->problem->n_channels;
    squares s = {.b = 0};
    for (size_t k = 0; k < C * n; k++) {
        const double weight = read != NULL ? (double)read[k % n] : 1;
        const double a = weight * p->problem->area[k % n];
        const figure_number one = number_of(p, k);
        s.b += a * one.b * one.b;
        s.bounced += a * one.bounced * one.bounced;
        s.off += a * one.off * one.off;
        s.noise += a * (one.noise * one.noise + one.light * one.light);
        s.apart += a * one.apart * one.apart;
    }
    return s;
}

/* Sums of 2 A x t, 2 A (B - E) t and 2 A B t over the elements of each part. Channels share the geometry, and
 * so the noise. */
typedef struct noise_sums {
    double off[FIGURE_PARTS], bounced[FIGURE_PARTS], b[FIGURE_PARTS];
} noise_sums;

static void find_noise(const figure_probe *p, noise_sums *out) {
    const size_t n = p->problem->n, C = p->problem->n_channels;
    *out = (noise_sums){.off = {0}};
    for (size_t i = 0; i < n; i++) {
        const size_t part = i * FIGURE_PARTS / n;
        for (size_t k = i; k < C * n; k += n) {
            const figure_number one = number_of(p, k);
            const double at = 2 * p->problem->area[i] * (one.noise + one.light);
            out->off[part] += at * one.off;
            out->bounced[part] += at * one.bounced;
            out->b[part] += at * one.b;
        }
    }
}

/* The larger distance of f to the roots of f^2 +- sigma. */
static double root_noise(double f2, double sigma) {
    const double f = sqrt(f2);
    return fmax(sqrt(f2 + sigma) - f, f - sqrt(fmax(0, f2 - sigma)));
}

/* Adds f, whose squared noise in part k is z_k = (off_k - f^2 light_k) / |d|^2. Returns df. */
static double add_noisy(double f2, double d2, const double *off, const double *light, figure_sums *to) {
    double z[FIGURE_PARTS], variance = 0, df = 0;
    for (int k = 0; k < FIGURE_PARTS; k++) {
        z[k] = (off[k] - f2 * light[k]) / d2;
        variance += z[k] * z[k];
    }
    if (variance > 0) {
        const double sigma = sqrt(variance);
        df = root_noise(f2, sigma);
        for (int k = 0; k < FIGURE_PARTS; k++) to->noise[k] += z[k] * df / sigma;
    }
    to->f += sqrt(f2);
    to->f2 += f2;
    to->most = fmax(to->most, sqrt(f2));
    return df;
}

static void add_figure(const figure_probe *p, const squares *s, double d2, const double *off,
                       const double *light, figure_tally *t) {
    const double plain = sqrt(s->off / d2), coarse = sqrt(s->apart / d2);
    const double df = add_noisy(s->off / d2, d2, off, light, &t->plain);
    (void)add_noisy(fmax(0, s->off - s->noise) / d2, d2, off, light, &t->less);
    t->count++;
    t->bound = fmax(t->bound, plain + 2 * hypot(df, coarse));
    if (p->y == NULL) return;
    t->coarse += coarse;
    t->coarse_plain += plain;
}

void figures_add(const figure_probe *p, figure_group *to) {
    const squares s = squares_of(p, NULL);
    noise_sums noise = {.off = {0}};
    if (s.noise > 0) find_noise(p, &noise);
    to->relative.tried++;
    to->indirect.tried++;
    if (s.b > 0) add_figure(p, &s, s.b, noise.off, noise.b, &to->relative);
    if (s.bounced > dark * dark * s.b) add_figure(p, &s, s.bounced, noise.off, noise.bounced, &to->indirect);
}

void receivers_add(const figure_probe *p, const float *read, receiver_sums *to) {
    const squares s = squares_of(p, read);
    to->b += s.b;
    to->bounced += s.bounced;
    to->off += s.off;
    to->noise += s.noise;
    if (p->y == NULL) return;
    to->apart += s.apart;
    to->apart_bounced += s.bounced;
}

receiver_figures receivers_of(const receiver_sums *total, const receiver_sums *own) {
    receiver_figures f = {.known = false};
    const receiver_sums *any = total->bounced > 0 ? total : own;
    if (!(any->bounced > dark * dark * any->b)) return f;
    f.known = true;
    f.operator_indirect = own->bounced > 0 ? sqrt(own->off / own->bounced) : 0;
    if (!(total->bounced > 0)) return f;
    const double apart = total->apart_bounced > 0 ? total->apart / total->apart_bounced : 0;
    double off = fmax(0, total->off - total->noise);
    f.noise = sqrt(total->noise / total->bounced + apart);
    f.is_bound = !(f.noise <= noise_most * sqrt(off / total->bounced));
    if (f.is_bound) off = pow(sqrt(total->off) + f.noise * sqrt(total->bounced), 2);
    f.total_indirect = sqrt(off / total->bounced);
    f.total_relative = sqrt(off / total->b);
    return f;
}

double figures_noise(const figure_tally *t, double repeated, bool bound) {
    const figure_sums *of = bound ? &t->plain : &t->less;
    double sum = 0;
    if (t->count == 0) return 0;
    for (int k = 0; k < FIGURE_PARTS; k++) sum += of->noise[k] * of->noise[k];
    const double coarse = t->coarse_plain > 0 ? t->coarse / t->coarse_plain * t->plain.f : 0;
    return sqrt(sum * (1 + repeated) + coarse * coarse) / (double)t->count;
}

double figures_spread(const figure_tally *t, size_t all) {
    const double m = (double)t->count, share = all > 0 ? (double)t->tried / (double)all : 0;
    if (share >= 1 || (t->count == 0 && t->tried > 1)) return 0;
    if (t->count < 2) return -1;
    const double variance = fmax(0, t->plain.f2 - t->plain.f * t->plain.f / m) / (m - 1);
    return sqrt(variance / m * (1 - share));
}

static error_figures figures_of(const figure_sums *s, size_t count) {
    if (count == 0) return (error_figures){.mean = 0};
    const double mean = s->f / (double)count, square = s->f2 / (double)count;
    return (error_figures){mean, sqrt(fmax(0, square - mean * mean)), s->most};
}

error_figures figures_mean(const figure_tally *t) {
    return figures_of(&t->less, t->count);
}

error_figures figures_bound(const figure_tally *t, double noise) {
    error_figures f = figures_of(&t->plain, t->count);
    f.mean += 2 * noise;
    f.max = fmax(f.mean, t->bound);
    return f;
}
