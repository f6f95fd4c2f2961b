#include "solver/method/judge/judge_by_group.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Noise is taken out of a square where it is at most this share of the rest: a third of an error. */
static const double noise_most = 1. / 9;

/* Light below this share of that in the whole scene is none: its ratios are all noise. */
static const double dark = 1e-6;

enum { SORT_UNIFORM, SORT_NEAR, SORT_FAR };

lam_status by_group_begin(const judge_input *input, size_t whole, by_group_sums *out, lam_error *error) {
    lam_status status = LAM_OK;
    by_group_sums s = {.n = input->problem->n,
                       .n_groups = input->n_groups,
                       .n_rows = input->read != NULL ? 2 : 1,
                       .group = input->group,
                       .read = input->read};
    s.bins = memory_allocate(by_group_bins(&s), sizeof *s.bins, "errors of groups", error);
    s.work = memory_allocate(by_group_bins(&s), 2 * BIN_NUMBERS * sizeof *s.work, "errors of groups", error);
    if (s.bins == NULL || s.work == NULL) TRY(LAM_ERR_MEMORY);
    s.even = memory_allocate(whole + 1, sizeof *s.even, "errors of groups", error);
    if (s.even == NULL) TRY(LAM_ERR_MEMORY);
    s.even_most = whole + 1;
    for (size_t k = 0; k < s.even_most; k++) {
        s.even[k].mean =
            memory_allocate(by_group_bins(&s), 2 * sizeof *s.even[k].mean, "errors of groups", error);
        if (s.even[k].mean == NULL) TRY(LAM_ERR_MEMORY);
        s.even[k].rms = s.even[k].mean + by_group_bins(&s);
    }
    for (size_t i = 0; i < s.n; i++) {
        bin_sums *b = &s.bins[by_group_bin(&s, i)];
        b->area += input->problem->area[i];
        b->squares += input->problem->area[i] * input->problem->area[i];
    }
    *out = s;
    s = (by_group_sums){.n = 0};
done:
    by_group_free(&s);
    return status;
}

void by_group_free(by_group_sums *sums) {
    free(sums->bins);
    free(sums->work);
    for (size_t k = 0; k < sums->even_most; k++) free(sums->even[k].mean);
    free(sums->even);
    *sums = (by_group_sums){.n = 0};
}

/* Sums of one channel: A E, A^2 E^2 and A (B - E) of all elements. */
typedef struct channel_sums {
    double power, squares, light;
} channel_sums;

/* Adds channel c of a probe to the numbers of the bins, which are sums over elements. */
static channel_sums add_channel(const figure_probe *p, size_t c, const by_group_sums *s) {
    const size_t n = s->n;
    channel_sums sum = {.power = 0};
    for (size_t i = 0; i < n; i++) {
        const figure_number one = figure_number_at(p, c * n + i);
        const double a = p->problem->area[i], E = a * (double)p->E[c * n + i];
        double *to = s->work + BIN_NUMBERS * by_group_bin(s, i);
        to[BIN_MEAN] += a * one.off;
        const double off2 = one.off * one.off, noise = one.noise * one.noise + one.light * one.light;
        to[BIN_MEAN_NOISE] += a * (one.noise + one.light);
        to[BIN_MEAN_APART] += a * a * noise;
        to[BIN_RMS] += a * off2;
        to[BIN_RMS_NOISE] += a * noise;
        to[BIN_RMS_SPREAD] += a * a * (off2 - noise) * (off2 - noise);
        to[BIN_LIGHT] += a * one.bounced;
        to[BIN_LIGHT_RMS] += a * one.bounced * one.bounced;
        sum.power += E;
        sum.squares += E * E;
        sum.light += a * one.bounced;
    }
    return sum;
}

/* Adds the error of the mean of a bin, and the light there, to one sort of light. */
static void add_ratio(double e2, double noise, double light2, int sort, bin_sums *to) {
    to->off[sort] += e2;
    to->noise[sort] += noise;
    to->light[sort] += light2;
    if (light2 > 0) to->largest[sort] = fmax(to->largest[sort], sqrt(e2 / light2));
}

double square_without_noise(double e2, double noise) {
    const double less = e2 - noise;
    return noise <= noise_most * less ? less : e2;
}

/* A probe, channels stacked. */
typedef struct probe_power {
    double P2, N, light2; /* P^2; squared mean of the reflected light of all elements */
} probe_power;

static void add_bin(const double at[BIN_NUMBERS], const probe_power *power, int kind, size_t bin,
                    by_group_sums *to) {
    bin_sums *b = &to->bins[bin];
    const double one = power->N / power->P2;
    if (kind == JUDGE_RANDOM) add_ratio(at[BIN_MEAN], at[BIN_MEAN_NOISE], at[BIN_LIGHT], SORT_UNIFORM, b);
    if (kind == JUDGE_WHOLE || kind == JUDGE_LIGHTS) {
        to->even[to->n_even].mean[bin] = square_without_noise(at[BIN_MEAN], at[BIN_MEAN_NOISE]) / power->P2;
        to->even[to->n_even].rms[bin] = square_without_noise(at[BIN_RMS], at[BIN_RMS_NOISE]) / power->P2;
    }
    if (kind != JUDGE_SINGLE) return;
    b->mean_one += one * at[BIN_MEAN];
    b->mean_one_noise += one * at[BIN_MEAN_NOISE];
    b->mean_all += at[BIN_MEAN];
    b->mean_all_noise += at[BIN_MEAN_NOISE];
    b->rms_one += one * at[BIN_RMS];
    b->rms_one_noise += one * at[BIN_RMS_NOISE];
    b->rms_all += at[BIN_RMS];
    b->rms_all_noise += at[BIN_RMS_NOISE];
    if (at[BIN_LIGHT] > dark * dark * power->light2)
        add_ratio(at[BIN_MEAN], at[BIN_MEAN_NOISE], at[BIN_LIGHT],
                  at[BIN_LIGHT] >= power->light2 ? SORT_NEAR : SORT_FAR, b);
}

/* Adds the numbers of a channel, means squared, to those of the probe. */
static void stack(const by_group_sums *s, const double *channel, double *stacked) {
    for (size_t k = 0; k < by_group_bins(s); k++) {
        const double area = s->bins[k].area, *from = channel + BIN_NUMBERS * k;
        double *to = stacked + BIN_NUMBERS * k;
        if (!(area > 0)) continue;
        to[BIN_MEAN] += from[BIN_MEAN] * from[BIN_MEAN] / (area * area);
        to[BIN_MEAN_NOISE] += from[BIN_MEAN_NOISE] * from[BIN_MEAN_NOISE] / (area * area);
        to[BIN_MEAN_APART] += from[BIN_MEAN_APART] / (area * area);
        to[BIN_RMS] += from[BIN_RMS] / area;
        to[BIN_RMS_NOISE] += from[BIN_RMS_NOISE] / area;
        to[BIN_RMS_SPREAD] += from[BIN_RMS_SPREAD] / (area * area);
        to[BIN_LIGHT] += from[BIN_LIGHT] * from[BIN_LIGHT] / (area * area);
        to[BIN_LIGHT_RMS] += from[BIN_LIGHT_RMS] / area;
    }
}

/* The numbers of all bins, [n_bins][BIN_NUMBERS], in to->work, and the power of the probe. */
static const double *find_numbers(const figure_probe *p, by_group_sums *to, probe_power *power) {
    const size_t n_bins = by_group_bins(to), bytes = n_bins * BIN_NUMBERS * sizeof *to->work;
    double *const stacked = to->work + n_bins * BIN_NUMBERS;
    double area = 0, squares = 0;
    *power = (probe_power){.P2 = 0};
    for (size_t k = 0; k < n_bins; k++) area += to->bins[k].area;
    memset(stacked, 0, bytes);
    for (size_t c = 0; c < p->problem->n_channels; c++) {
        memset(to->work, 0, bytes);
        const channel_sums sum = add_channel(p, c, to);
        stack(to, to->work, stacked);
        power->P2 += sum.power * sum.power;
        power->light2 += sum.light * sum.light / (area * area);
        squares += sum.squares;
    }
    if (power->P2 > 0) power->N = power->P2 / squares;
    return stacked;
}

const double *by_group_numbers(const figure_probe *p, by_group_sums *with) {
    probe_power power;
    return find_numbers(p, with, &power);
}

void by_group_add(const figure_probe *p, int kind, by_group_sums *to) {
    probe_power power;
    const double *stacked = find_numbers(p, to, &power);
    if (!(power.P2 > 0)) return;
    for (size_t k = 0; k < by_group_bins(to); k++) add_bin(stacked + BIN_NUMBERS * k, &power, kind, k, to);
    if (kind == JUDGE_SINGLE) {
        to->n_single++;
        to->power += power.P2 / power.N;
    } else if (kind != JUDGE_RANDOM) {
        to->even[to->n_even++].per_number = 1 / power.N;
    }
}

/* The root of the mean square of probes with many elements, less many^2 / N. */
static double even_of(const by_group_sums *s, size_t bin, bool rms, double many2) {
    double sum = 0;
    for (size_t k = 0; k < s->n_even; k++)
        sum += fmax(0, (rms ? s->even[k].rms : s->even[k].mean)[bin] - many2 * s->even[k].per_number);
    return s->n_even > 0 ? sqrt(sum / (double)s->n_even) : 0;
}

static double ratio_of(const bin_sums *b, int sort) {
    return b->light[sort] > 0 ? sqrt(square_without_noise(b->off[sort], b->noise[sort]) / b->light[sort])
                              : NAN;
}

static void finish_bin(const by_group_sums *s, size_t k, double **of) {
    const bin_sums *b = &s->bins[k];
    const double m = (double)s->n_single;
    double mean_one = 0, mean_many = 0, rms_one = 0, rms_many = 0;
    if (s->n_single > 0) {
        /* The errors of elements alike count alike in one^2, and by their power in what many add up to. The
         * geometric mean of both is taken for many: the few probes are not enough to know the second. */
        const double mean = square_without_noise(b->mean_one, b->mean_one_noise) / m;
        const double rms = square_without_noise(b->rms_one, b->rms_one_noise) / m;
        mean_one = sqrt(mean);
        rms_one = sqrt(rms);
        mean_many = pow(mean * square_without_noise(b->mean_all, b->mean_all_noise) / s->power, .25);
        rms_many = pow(rms * square_without_noise(b->rms_all, b->rms_all_noise) / s->power, .25);
    }
    /* The few probes may all be right on average where the elements are off: no mean is known better than
     * independent errors of these leave it. */
    const double least = b->area > 0 ? sqrt(b->squares) / b->area : 0;
    const double rms_even = even_of(s, k, true, rms_many * rms_many);
    of[GROUP_MEAN_ONE][k] = fmax(mean_one, least * rms_one);
    of[GROUP_MEAN_MANY][k] = fmax(mean_many, least * rms_many);
    of[GROUP_MEAN_EVEN][k] = fmax(even_of(s, k, false, mean_many * mean_many), least * rms_even);
    of[GROUP_RMS_ONE][k] = rms_one;
    of[GROUP_RMS_MANY][k] = rms_many;
    of[GROUP_RMS_EVEN][k] = rms_even;
    const int sorts[] = {GROUP_UNIFORM, GROUP_NEAR, GROUP_FAR};
    for (int sort = 0; sort < 3; sort++) {
        of[sorts[sort]][k] = ratio_of(b, sort);
        of[sorts[sort] + 1][k] = b->light[sort] > 0 ? b->largest[sort] : NAN;
    }
}

lam_status by_group_finish(const by_group_sums *sums, double **of, lam_error *error) {
    double *made[GROUP_FIGURES] = {NULL};
    for (int f = 0; f < GROUP_FIGURES; f++) {
        made[f] = memory_allocate(by_group_bins(sums), sizeof *made[f], "errors of groups", error);
        if (made[f] != NULL) continue;
        while (f-- > 0) free(made[f]);
        return LAM_ERR_MEMORY;
    }
    for (size_t k = 0; k < by_group_bins(sums); k++) finish_bin(sums, k, made);
    memcpy(of, made, sizeof made);
    return LAM_OK;
}

worst_group judge_worst_group(const group_errors *e) {
    static const int sorts[] = {GROUP_UNIFORM, GROUP_NEAR, GROUP_FAR};
    worst_group worst = {.group = e->n_groups, .figure = GROUP_UNIFORM};
    for (size_t k = 0; k < sizeof sorts / sizeof *sorts && e->of[sorts[k]] != NULL; k++) {
        const double *total = e->of[sorts[k]], *own = e->of_operator[sorts[k]];
        for (size_t g = 0; g < e->n_groups; g++) {
            if (!(total[g] > worst.total)) continue; /* nor where it is not known */
            worst = (worst_group){.group = g,
                                  .figure = sorts[k],
                                  .total = total[g],
                                  .of_operator = own != NULL && own[g] >= 0 ? fmin(own[g], total[g])
                                                                            : total[g] * sqrt(.5)};
        }
    }
    return worst;
}
