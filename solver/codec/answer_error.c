#include "solver/codec/answer_error.h"

#include "solver/base/weighted.h"

#include <math.h>
#include <stdlib.h>

double emission_size_number(const emission_size *e) {
    return e->squares > 0 ? e->power2 / e->squares : 0;
}

void emission_size_add(emission_size *e, size_t n, const double *weights, const float *E) {
    double power = 0, squares = 0;
    for (size_t i = 0; i < n; i++) {
        const double flux = weights[i] * (double)E[i];
        power += flux;
        squares += flux * flux;
    }
    e->power2 += power * power;
    e->squares += squares;
}

emission_size emission_size_sum(const emission_size *a, const emission_size *b) {
    const double power = sqrt(a->power2) + sqrt(b->power2);
    return (emission_size){power * power, a->squares + b->squares};
}

/* P^2 (one^2 / N^2 + many^2 (1 - 1/N) / N + even^2): the square of an error. */
static double error2(const emission_size *size, double one, double many, double even) {
    const double share = size->power2 > 0 ? size->squares / size->power2 : 1; /* 1 / N */
    return size->power2 *
           (one * one * share * share + many * many * share * fmax(0, 1 - share) + even * even);
}

static weighted_sums sky_channel(const error_by_group *e, const float *L, size_t c) {
    return weighted_sums_of(e->n_tiles, e->sky_power + c * e->n_tiles, L + c * e->n_tiles);
}

/* P^2, S and W of a sky (sky_law), [C][n_tiles]. */
typedef struct sky_sizes {
    const float *L; /* NULL: no sky, or nothing is stated of skies */
    double power2, spread, power_off;
} sky_sizes;

static sky_sizes sky_sizes_of(const error_by_group *e, const float *L) {
    sky_sizes of = {.L = e->n_tiles > 0 ? L : NULL};
    for (size_t c = 0; of.L != NULL && c < e->n_channels; c++) {
        const weighted_sums sums = sky_channel(e, L, c);
        of.power2 += sums.sum * sums.sum;
        of.spread += sums.spread;
        if (e->power_off != NULL)
            of.power_off +=
                weighted_spread(e->n_tiles, e->power_off + c * e->n_tiles, L + c * e->n_tiles, sums.mean);
    }
    return of;
}

/* The quantity of an answer, its emission and its sky, and a sky whose bounced light alone is in it. */
typedef struct light_sizes {
    lam_quantity quantity;
    emission_size size;
    sky_sizes sky, sent;
    double lost2; /* of error_answer */
} light_sizes;

/* Of the light that is reflected the direct light of a sky is no part, nor are errors of it. A store of
 * before does not tell them apart. */
static light_sizes light_sizes_of(const error_by_group *e, lam_quantity quantity, const emission_size *size,
                                  const float *L) {
    light_sizes of = {.quantity = quantity, .size = *size};
    *(quantity == LAM_INDIRECT && e->power_off != NULL ? &of.sent : &of.sky) = sky_sizes_of(e, L);
    return of;
}

static light_sizes sizes_of_answer(const error_by_group *e, const error_answer *of) {
    light_sizes sizes = light_sizes_of(e, of->quantity, &of->size, of->L);
    const sky_sizes sent = sky_sizes_of(e, e->power_off != NULL ? of->L_sent : NULL);
    if (sent.L == NULL) return sizes;
    if (sizes.sent.L == NULL) sizes.sent.L = sent.L;
    sizes.sent.power2 += sent.power2;
    sizes.sent.spread += sent.spread;
    sizes.sent.power_off += sent.power_off;
    sizes.lost2 = of->lost2;
    return sizes;
}

/* Squares of the errors of a bin: of its elements, and of its mean. */
typedef struct bin_error {
    double elements2, mean2;
} bin_error;

/* D of a group by weights of its tiles, [n_groups][n_tiles]; 0 where these are NULL. Of irradiance, which is
 * what stores state where nothing is reflected, rho is 1. */
static double direct_of(const error_by_group *e, const double *weights, const light_sizes *of, size_t group) {
    const size_t m = e->n_tiles;
    const float *L = of->sky.L;
    const bool as_white = of->quantity == LAM_IRRADIANCE;
    double sum = 0;
    for (size_t c = 0; weights != NULL && c < e->n_channels; c++) {
        const double rho = as_white ? 1 : e->reflectance[c * e->n_groups + group];
        const double spread = weighted_spread(m, weights + group * m, L + c * m, sky_channel(e, L, c).mean);
        sum += rho * rho * spread;
    }
    return sum;
}

/* The part of the direct light of single tiles. */
static bin_error error_of_direct(const error_by_group *e, const light_sizes *of, size_t bin) {
    const sky_law *sky = &e->sky;
    const size_t group = bin % e->n_groups;
    if (of->sky.L == NULL) return (bin_error){0, 0};
    if (e->power_off != NULL)
        return (bin_error){direct_of(e, e->elements_off, of, group), direct_of(e, e->means_off, of, group)};
    double area = 0;
    for (size_t k = group; k < e->n_bins; k += e->n_groups) area += e->area[k];
    const double direct = sky->direct * sky->direct * direct_of(e, e->sky_first, of, group);
    return (bin_error){direct, direct * (area > 0 ? e->squares[group] / (area * area) : 1)};
}

/* That of a sky beside its direct light: what single tiles are off by beyond it, and an even sky. */
static void add_sky(const error_by_group *e, const sky_sizes *of, size_t bin, bin_error *sum) {
    const sky_law *sky = &e->sky;
    const bool known = e->power_off != NULL;
    if (of->L == NULL) return;
    sum->elements2 += (known ? sky->bounced[bin] * sky->bounced[bin] * of->power_off : 0) +
                      sky->tiles[bin] * sky->tiles[bin] * of->spread +
                      sky->even[bin] * sky->even[bin] * of->power2;
    sum->mean2 += (known ? sky->mean_bounced[bin] * sky->mean_bounced[bin] * of->power_off : 0) +
                  sky->mean_tiles[bin] * sky->mean_tiles[bin] * of->spread +
                  sky->mean_even[bin] * sky->mean_even[bin] * of->power2;
}

/* That of the light of a sky that is reflected alone: what the power is off by that it sends into the scene,
 * W and, of an even sky, the errors of the means of groups as if independent; and the law of an emission of
 * that power from all elements. It is at most what the law of skies says of all their light. */
static void add_sent(const error_by_group *e, const light_sizes *of, size_t bin, bin_error *sum) {
    const error_law *law = &e->law;
    const sky_law *sky = &e->sky;
    double area = 0, squares = 0, off2 = of->sent.power_off + of->lost2;
    if (of->sent.L == NULL) return;
    for (size_t b = 0; b < e->n_bins; b++) {
        const double flux = e->of_group[b % e->n_groups].black ? 0 : e->area[b] * sky->mean_even[b];
        off2 += flux * flux * of->sent.power2;
        area += e->area[b];
    }
    for (size_t g = 0; g < e->n_groups; g++) squares += e->squares[g];
    const emission_size size = {of->sent.power2, area > 0 ? of->sent.power2 * squares / (area * area) : 0};
    bin_error all = {0, 0};
    add_sky(e, &of->sent, bin, &all);
    sum->elements2 += fmin(all.elements2, sky->bounced[bin] * sky->bounced[bin] * off2 +
                                              error2(&size, law->one[bin], law->many[bin], law->even[bin]));
    sum->mean2 +=
        fmin(all.mean2, sky->mean_bounced[bin] * sky->mean_bounced[bin] * off2 +
                            error2(&size, law->mean_one[bin], law->mean_many[bin], law->mean_even[bin]));
}

static bin_error error_in(const error_by_group *e, const light_sizes *of, size_t bin) {
    const error_law *law = &e->law;
    const reflecting *group = &e->of_group[bin % e->n_groups];
    if (group->black && of->quantity != LAM_IRRADIANCE) return (bin_error){0, 0};
    bin_error sum = {error2(&of->size, law->one[bin], law->many[bin], law->even[bin]),
                     error2(&of->size, law->mean_one[bin], law->mean_many[bin], law->mean_even[bin])};
    const bin_error direct = error_of_direct(e, of, bin);
    add_sky(e, &of->sky, bin, &sum);
    add_sent(e, of, bin, &sum);
    return (bin_error){reflecting_of_elements(group, of->quantity, sum.elements2) + direct.elements2,
                       reflecting_of_mean(group, of->quantity, sum.mean2) + direct.mean2};
}

/* The error over the light that there is without it: the light of the answer has the error in it, and its
 * square is larger by that of the error on average. Not finite where nothing is left. */
static double ratio(double error2, double light2) {
    return error2 > 0 ? sqrt(error2 / fmax(light2 - error2, 0)) : 0;
}

/* Sums over the values of a bin: A, and of r = B - E - rho H0, B and L = B - E, of irradiance H - H0, H and
 * H, the sums of A r^2, A B^2, A L^2 over channels, and of each channel A r, A B and A L. */
typedef struct value_sums {
    double area, reflected2, radiosity2, light2;
    double *reflected, *radiosity, *light; /* [C]; NULL: not wanted */
} value_sums;

/* Adds values first ... last - 1 of the answer, whose elements are in one bin: sums in registers, as those in
 * memory would wait for each other. */
static void add_run(const error_scene *scene, const error_answer *of, size_t first, size_t last,
                    value_sums *to) {
    const size_t n = scene->n;
    const bool irradiance = of->quantity == LAM_IRRADIANCE;
    const double of_sky = irradiance, of_direct = of->quantity == LAM_RADIOSITY;
    for (size_t c = 0; c < scene->n_channels; c++) {
        const float *values = of->values + c * (of->whole ? n : of->count);
        double area = 0, reflected = 0, reflected2 = 0, radiosity = 0, radiosity2 = 0, light = 0, light2 = 0;
        for (size_t k = first; k < last; k++) {
            const size_t i = of->selected != NULL ? of->selected[k] : k;
            const double a = scene->area[i], rho = (double)scene->reflectance[c * n + i];
            const double sky = of->H0 != NULL ? (double)of->H0[c * n + i] : 0;
            const double direct = (of->E != NULL ? (double)of->E[c * n + i] : 0) + rho * sky;
            const double value = (double)values[of->whole ? i : k];
            const double r = value - of_sky * sky - of_direct * direct, b = irradiance ? value : r + direct;
            const double l = r + (irradiance ? sky : rho * sky);
            area += a;
            reflected += a * r;
            reflected2 += a * r * r;
            radiosity += a * b;
            radiosity2 += a * b * b;
            light += a * l;
            light2 += a * l * l;
        }
        if (c == 0) to->area += area;
        if (to->reflected != NULL) to->reflected[c] += reflected;
        if (to->radiosity != NULL) to->radiosity[c] += radiosity;
        if (to->light != NULL) to->light[c] += light;
        to->reflected2 += reflected2;
        to->radiosity2 += radiosity2;
        to->light2 += light2;
    }
}

/* [n_bins]; freed with free(). */
static value_sums *sum_values(const error_by_group *e, const error_scene *scene, const error_answer *of) {
    const size_t C = scene->n_channels;
    size_t bytes;
    if (!size_multiply(e->n_bins, sizeof(value_sums) + 3 * C * sizeof(double), &bytes)) return NULL;
    value_sums *sums = memory_allocate(bytes, 1, "errors of groups", NULL);
    if (sums == NULL) return NULL;
    double *numbers = (double *)(void *)(sums + e->n_bins);
    for (size_t b = 0; b < e->n_bins; b++) {
        sums[b].reflected = numbers + 3 * b * C;
        sums[b].radiosity = sums[b].reflected + C;
        sums[b].light = sums[b].radiosity + C;
    }
    for (size_t first = 0, last; first < of->count; first = last) {
        const uint32_t bin = e->bin[of->selected != NULL ? of->selected[first] : first];
        for (last = first + 1; last < of->count; last++)
            if (e->bin[of->selected != NULL ? of->selected[last] : last] != bin) break;
        add_run(scene, of, first, last, &sums[bin]);
    }
    return sums;
}

static double overlap_in(const error_by_group *e, size_t bin) {
    return e->overlap != NULL ? e->overlap[bin % e->n_groups] : 0;
}

/* The square, over that of the light, that faces which count twice are off by: of the elements of a bin. */
static double overlap_elements2(const error_by_group *e, size_t bin) {
    return e->repair * e->repair + overlap_in(e, bin) / 2;
}

/* That of a mean, by the sums of its light and of the light that may be covered. */
static double overlap_mean2(const error_by_group *e, double light, double covered) {
    return e->repair * e->repair * light * light + covered * covered / 2;
}

answer_error answer_error_of_square(const error_scene *scene, const error_answer *of, double off2) {
    value_sums sums = {.area = 0};
    add_run(scene, of, 0, of->count, &sums);
    return (answer_error){.relative = ratio(off2, sums.radiosity2), .indirect = ratio(off2, sums.reflected2)};
}

bool answer_error_of(const error_by_group *e, const error_scene *scene, const error_answer *of,
                     answer_error *out) {
    double off = 0, reflected = 0, radiosity = 0;
    const light_sizes sizes = sizes_of_answer(e, of);
    const emission_size both = emission_size_sum(&of->size, &of->sky);
    value_sums *sums = sum_values(e, scene, of);
    if (sums == NULL) return false;
    for (size_t b = 0; b < e->n_bins; b++) {
        if (!(sums[b].area > 0)) continue;
        off += sums[b].area * error_in(e, &sizes, b).elements2 + overlap_elements2(e, b) * sums[b].light2;
        reflected += sums[b].reflected2;
        radiosity += sums[b].radiosity2;
    }
    free(sums);
    *out = (answer_error){.relative = ratio(off, radiosity),
                          .indirect = ratio(off, reflected),
                          .emitters = emission_size_number(&both)};
    return true;
}

/* Mean squared errors of a name's bins, by area. */
typedef struct name_sums {
    double area, mean2, elements2;
} name_sums;

static void add_bin(const error_by_group *e, const light_sizes *size, size_t bin, double area,
                    name_sums *to) {
    if (!(area > 0)) return;
    const bin_error error = error_in(e, size, bin);
    to->area += area;
    to->mean2 += area * error.mean2;
    to->elements2 += area * error.elements2;
}

/* reflected2, radiosity2: squares of the means over the name. */
name_error name_error_of_squares(double mean2, double elements2, double reflected2, double radiosity2) {
    return (name_error){.mean = ratio(mean2, reflected2),
                        .elements = ratio(elements2, reflected2),
                        .relative = ratio(mean2, radiosity2)};
}

static name_error finish_name(const name_sums *s, double reflected2, double radiosity2) {
    if (!(s->area > 0)) return (name_error){.mean = 0};
    return name_error_of_squares(s->mean2 / s->area, s->elements2 / s->area, reflected2, radiosity2);
}

bool name_errors_of(const error_by_group *e, const error_scene *scene, const error_answer *of,
                    const reduce_request *names, name_error *errors) {
    const size_t n_rows = e->n_bins / e->n_groups;
    const light_sizes sizes = sizes_of_answer(e, of);
    value_sums *sums = sum_values(e, scene, of);
    if (sums == NULL) return false;
    for (size_t k = 0; k < names->n_names; k++) {
        const reduce_name *name = &names->names[k];
        name_sums s = {.area = 0};
        double reflected2 = 0, radiosity2 = 0;
        for (size_t g = 0; g < name->n_groups; g++)
            for (size_t row = 0; row < n_rows; row++) {
                const size_t bin = row * e->n_groups + name->groups[g];
                add_bin(e, &sizes, bin, sums[bin].area, &s);
                s.elements2 += overlap_elements2(e, bin) * sums[bin].light2;
            }
        for (size_t c = 0; c < scene->n_channels; c++) {
            double reflected = 0, radiosity = 0, light = 0, covered = 0;
            for (size_t g = 0; g < name->n_groups; g++)
                for (size_t row = 0; row < n_rows; row++) {
                    const size_t bin = row * e->n_groups + name->groups[g];
                    reflected += sums[bin].reflected[c];
                    radiosity += sums[bin].radiosity[c];
                    light += sums[bin].light[c];
                    covered += overlap_in(e, bin) * sums[bin].light[c];
                }
            s.mean2 +=
                overlap_mean2(e, light, covered) / s.area; /* of sums by area, over it once more below */
            reflected2 += reflected * reflected / (s.area * s.area);
            radiosity2 += radiosity * radiosity / (s.area * s.area);
        }
        const name_error found = finish_name(&s, reflected2, radiosity2);
        errors[k].mean = found.mean;
        errors[k].elements = found.elements;
        errors[k].relative = found.relative;
    }
    free(sums);
    return true;
}

name_error name_error_of_means(const error_by_group *e, const reduce_name *name, const name_means *means) {
    const size_t n_rows = e->n_bins / e->n_groups;
    const light_sizes sizes = light_sizes_of(e, means->quantity, &means->size, means->L);
    name_sums s = {.area = 0};
    double reflected2 = 0, radiosity2 = 0, covered = 0;
    for (size_t g = 0; g < name->n_groups; g++)
        for (size_t row = 0; row < n_rows; row++) {
            const size_t bin = row * e->n_groups + name->groups[g];
            add_bin(e, &sizes, bin, e->area[bin], &s);
            covered += overlap_in(e, bin) * e->area[bin];
        }
    for (size_t c = 0; c < e->n_channels; c++) {
        double rho = 0;
        for (size_t g = 0; g < name->n_groups; g++)
            for (size_t row = 0; row < n_rows; row++)
                rho += e->area[row * e->n_groups + name->groups[g]] *
                       e->reflectance[c * e->n_groups + name->groups[g]];
        rho /= s.area;
        const double value = means->value[c], direct = means->emission[c] + rho * means->direct[c];
        const bool irradiance = means->quantity == LAM_IRRADIANCE;
        const double r = value - (irradiance                         ? means->direct[c]
                                  : means->quantity == LAM_RADIOSITY ? direct
                                                                     : 0);
        reflected2 += r * r;
        radiosity2 += irradiance ? value * value : (r + direct) * (r + direct);
        /* As if it were even over the name. */
        const double light = r + (irradiance ? 1 : rho) * means->direct[c];
        s.mean2 += s.area * overlap_mean2(e, light, covered / s.area * light);
        s.elements2 += s.area * (e->repair * e->repair + covered / s.area / 2) * light * light;
    }
    return finish_name(&s, reflected2, radiosity2);
}
