#include "solver/operator/stated/answer_error.h"

#include "solver/operator/stated/whole_law.h"

#include <math.h>
#include <stdlib.h>

double stated_of_parts(const stated_parts *parts) {
    return hypot(hypot(parts->rest, fmax(parts->mesh, 0)), hypot(parts->sun, parts->rows));
}

void error_answer_add_channel(error_answer *of, const error_scene *scene, size_t c, const float *E,
                              const float *H, const float *lamps, float *work) {
    const size_t n = scene->n;
    const float *rho = scene->reflectance + c * n;
    float *reflected = work, *sent = work + n;
    double power = 0; /* sum A rho H of luminaires */
    if (H == NULL) {
        emission_size_add(&of->size, n, scene->area, E);
        return;
    }
    for (size_t i = 0; i < n; i++) {
        reflected[i] = rho[i] * H[i];
        sent[i] = E[i] + reflected[i];
        if (lamps != NULL) power += scene->area[i] * (double)(rho[i] * lamps[i]);
    }
    emission_size_add(&of->size, n, scene->area, sent);
    emission_size_add(&of->reflected, n, scene->area, reflected);
    of->luminaires.power2 += power * power;
}

/* P^2 of the part of an emission that groups with lamps emit. */
static double lamps2_of(const error_by_group *e, const error_scene *scene, const float *E) {
    double sum = 0;
    for (size_t c = 0; E != NULL && e->mesh.lamps != NULL && c < scene->n_channels; c++) {
        double power = 0;
        for (size_t i = 0; i < scene->n; i++)
            if (mesh_lamps_in(e, e->bin[i])) power += scene->area[i] * (double)E[c * scene->n + i];
        sum += power * power;
    }
    return sum;
}

/* The first light of a sun or of luminaires, of which E tells nothing, has the law of its size alone. *sizes
 * owns its whole groups. False when memory is short. */
bool answer_sizes_of(const error_by_group *e, const error_scene *scene, const error_answer *of,
                     light_sizes *sizes) {
    *sizes = light_sizes_of(e, of->quantity, &of->size, of->L);
    sizes->luminaires = of->luminaires;
    sizes->size.lamps2 = lamps2_of(e, scene, of->E);
    const sky_sizes sent = sky_sizes_of(e, of->L_sent);
    if (sent.L == NULL) {
        if (!whole_light_find(e, scene, of->E, &sizes->whole)) return false;
        sizes->whole.rest = emission_size_sum(&sizes->whole.rest, &of->reflected);
        return true;
    }
    if (sizes->sent.L == NULL) sizes->sent.L = sent.L;
    sizes->sent.power2 += sent.power2;
    sizes->sent.spread += sent.spread;
    sizes->sent.squares += sent.squares;
    sizes->sent.power_off += sent.power_off;
    sizes->lost2 = of->lost2;
    return true;
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

/* [n_bins]; freed with free(). For figures: without elements that these leave out. */
static value_sums *sum_values(const error_by_group *e, const error_scene *scene, const error_answer *of,
                              bool for_figures) {
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
    const bool *buried = for_figures ? scene->buried : NULL;
    for (size_t first = 0, last; first < of->count; first = last) {
        const size_t i = of->selected != NULL ? of->selected[first] : first;
        const uint32_t bin = e->bin[i];
        for (last = first + 1; last < of->count; last++) {
            const size_t next = of->selected != NULL ? of->selected[last] : last;
            if (e->bin[next] != bin || (buried != NULL && buried[next] != buried[i])) break;
        }
        if (buried != NULL && buried[i]) continue;
        add_run(scene, of, first, last, &sums[bin]);
    }
    return sums;
}

/* Finds parts from squares of the light that is reflected, and of all; mesh2 negative: not stated. */
static stated_parts parts_of(double off2, double mesh2, double light2, double radiosity2) {
    const double all2 = light2 > 0 ? light2 : radiosity2;
    return (stated_parts){.rest = off2 > 0 ? error_ratio(off2, all2) : 0,
                          .mesh = mesh2 < 0    ? -1
                                  : light2 > 0 ? sqrt(mesh2 / light2)
                                               : 0};
}

/* The error of all values where its square is known, sum A |B~ - B|^2 over channels and the values. */
static answer_error error_of_square(const error_scene *scene, const error_answer *of, double off2) {
    value_sums sums = {.area = 0};
    add_run(scene, of, 0, of->count, &sums);
    return (answer_error){.relative = error_ratio(off2, sums.radiosity2),
                          .indirect = error_ratio(off2, sums.reflected2),
                          .parts = parts_of(off2, -1, sums.reflected2, sums.radiosity2)};
}

bool answer_error_of(const error_by_group *e, const error_scene *scene, const error_answer *of,
                     answer_error *out) {
    double off = 0, reflected = 0, radiosity = 0, light = 0, mesh = 0;
    const emission_size both = emission_size_sum(&of->size, &of->sky);
    light_sizes sizes;
    value_sums *sums = answer_sizes_of(e, scene, of, &sizes) ? sum_values(e, scene, of, false) : NULL;
    if (sums == NULL) {
        whole_light_free(&sizes.whole);
        return false;
    }
    for (size_t b = 0; b < e->n_bins; b++) {
        if (!(sums[b].area > 0)) continue;
        off += sums[b].area * error_law(e, &sizes, b).elements2 + overlap_elements2(e, b) * sums[b].light2;
        reflected += sums[b].reflected2;
        radiosity += sums[b].radiosity2;
        const double l = of->quantity == LAM_INDIRECT ? sums[b].reflected2 : sums[b].light2;
        light += l;
        mesh += mesh_lack_of_bin(e, &sizes, b).elements2 * l;
    }
    free(sums);
    whole_light_free(&sizes.whole);
    if (!mesh_is_stated(e)) mesh = -1;
    *out = (answer_error){.relative = error_ratio(off, radiosity),
                          .indirect = error_ratio(off, reflected),
                          .emitters = emission_size_number(&both),
                          .parts = parts_of(off, mesh, light, radiosity)};
    return true;
}

/* Sums over a name's bins: A, and, by area, mean squared errors of means and of elements, and the share of
 * the mean that the mesh leaves, which has one sign in all groups at worst. */
typedef struct name_sums {
    double area, mean2, elements2, mesh;
} name_sums;

static void add_bin(const error_by_group *e, const light_sizes *size, size_t bin, double area,
                    name_sums *to) {
    if (!(area > 0)) return;
    const bin_error error = error_law(e, size, bin);
    to->area += area;
    to->mean2 += area * error.mean2;
    to->elements2 += area * error.elements2;
    to->mesh += area * sqrt(mesh_lack_of_bin(e, size, bin).mean2);
}

/* Turns errors of all elements of a name, of which a share of the area is buried and has none, into those of
 * the others: the error of the mean is the same power on less area. */
static void leave_out(double buried, name_sums *s) {
    const double seen = 1 - buried;
    if (!(seen > 0)) return;
    s->mean2 /= seen * seen;
    s->elements2 /= seen;
}

/* reflected2, radiosity2: squares of the means over the name. */
static name_error error_of_squares(double mean2, double elements2, double reflected2, double radiosity2) {
    return (name_error){.mean = error_ratio(mean2, reflected2),
                        .elements = error_ratio(elements2, reflected2),
                        .relative = error_ratio(mean2, radiosity2)};
}

/* light2: the square of the mean of the light that the parts of the headline are over. */
static name_error finish_name(const error_by_group *e, const name_sums *s, double reflected2,
                              double radiosity2, double light2) {
    if (!(s->area > 0)) return (name_error){.mean = 0};
    name_error made = error_of_squares(s->mean2 / s->area, s->elements2 / s->area, reflected2, radiosity2);
    const double mesh2 = mesh_is_stated(e) ? s->mesh * s->mesh / (s->area * s->area) * light2 : -1;
    made.parts = parts_of(s->mean2 / s->area, mesh2, light2, radiosity2);
    return made;
}

bool name_errors_of(const error_by_group *e, const error_scene *scene, const error_answer *of, size_t n_names,
                    const reduce_name *names, name_error *errors) {
    const size_t n_rows = e->n_bins / e->figures.n_groups;
    light_sizes sizes;
    value_sums *sums = answer_sizes_of(e, scene, of, &sizes) ? sum_values(e, scene, of, true) : NULL;
    if (sums == NULL) {
        whole_light_free(&sizes.whole);
        return false;
    }
    for (size_t k = 0; k < n_names; k++) {
        const reduce_name *name = &names[k];
        name_sums s = {.area = 0};
        double reflected2 = 0, radiosity2 = 0, light2 = 0, all = 0;
        for (size_t g = 0; g < name->n_groups; g++)
            for (size_t row = 0; row < n_rows; row++) {
                const size_t bin = row * e->figures.n_groups + name->groups[g];
                all += e->area[bin];
                add_bin(e, &sizes, bin, sums[bin].area, &s);
            }
        if (scene->buried != NULL) leave_out(1 - s.area / all, &s);
        for (size_t g = 0; g < name->n_groups; g++)
            for (size_t row = 0; row < n_rows; row++) {
                const size_t bin = row * e->figures.n_groups + name->groups[g];
                s.elements2 += overlap_elements2(e, bin) * sums[bin].light2;
            }
        for (size_t c = 0; c < scene->n_channels; c++) {
            double reflected = 0, radiosity = 0, light = 0, covered = 0;
            for (size_t g = 0; g < name->n_groups; g++)
                for (size_t row = 0; row < n_rows; row++) {
                    const size_t bin = row * e->figures.n_groups + name->groups[g];
                    reflected += sums[bin].reflected[c];
                    radiosity += sums[bin].radiosity[c];
                    light += sums[bin].light[c];
                    covered += overlap_of_bin(e, bin) * sums[bin].light[c];
                }
            s.mean2 +=
                overlap_mean2(e, light, covered) / s.area; /* of sums by area, over it once more below */
            reflected2 += reflected * reflected / (s.area * s.area);
            radiosity2 += radiosity * radiosity / (s.area * s.area);
            light2 += light * light / (s.area * s.area);
        }
        const char *const called = errors[k].name;
        errors[k] =
            finish_name(e, &s, reflected2, radiosity2, of->quantity == LAM_INDIRECT ? reflected2 : light2);
        errors[k].name = called;
    }
    free(sums);
    whole_light_free(&sizes.whole);
    return true;
}

name_error name_error_of_means(const error_by_group *e, const reduce_name *name, const name_means *means) {
    const size_t n_rows = e->n_bins / e->figures.n_groups;
    light_sizes sizes = light_sizes_of(e, means->quantity, &means->size, means->L);
    sizes.whole = means->whole;
    sizes.luminaires = means->luminaires;
    name_sums s = {.area = 0};
    double reflected2 = 0, radiosity2 = 0, light2 = 0, covered = 0;
    for (size_t g = 0; g < name->n_groups; g++)
        for (size_t row = 0; row < n_rows; row++) {
            const size_t bin = row * e->figures.n_groups + name->groups[g];
            add_bin(e, &sizes, bin, e->area[bin], &s);
            covered += overlap_of_bin(e, bin) * e->area[bin];
        }
    leave_out(means->buried, &s);
    for (size_t c = 0; c < e->figures.n_channels; c++) {
        double rho = 0;
        for (size_t g = 0; g < name->n_groups; g++)
            for (size_t row = 0; row < n_rows; row++)
                rho += e->area[row * e->figures.n_groups + name->groups[g]] *
                       e->reflectance[c * e->figures.n_groups + name->groups[g]];
        rho /= s.area;
        const double value = means->value[c];
        const double sky = means->buried < 1 ? means->direct[c] / (1 - means->buried) : 0;
        const double direct = means->emission[c] + rho * sky;
        const bool irradiance = means->quantity == LAM_IRRADIANCE;
        const double r = value - (irradiance ? sky : means->quantity == LAM_RADIOSITY ? direct : 0);
        reflected2 += r * r;
        radiosity2 += irradiance ? value * value : (r + direct) * (r + direct);
        /* As if it were even over the name. */
        const double light = r + (irradiance ? 1 : rho) * sky;
        light2 += light * light;
        s.mean2 += s.area * overlap_mean2(e, light, covered / s.area * light);
        s.elements2 += s.area * (e->repair * e->repair + covered / s.area / 2) * light * light;
    }
    return finish_name(e, &s, reflected2, radiosity2, means->quantity == LAM_INDIRECT ? reflected2 : light2);
}

answer_error emitters_error_of(const emitters_error *e, const error_scene *scene, const error_answer *of,
                               emitters_mix *mix) {
    double off = of->selected != NULL ? 0 : emitters_mix_all2(e, of->quantity, mix);
    for (size_t k = 0; of->selected != NULL && k < of->count; k++) {
        const uint32_t i = of->selected[k], g = e->group[i];
        emitters_mix_find(e, g, mix);
        off += scene->area[i] / e->area[g] *
               reflecting_of_elements(&e->black[g], of->quantity, mix->of_group[g]);
    }
    answer_error made = error_of_square(scene, of, off);
    made.emitters = mix->emitters;
    return made;
}

name_error emitters_error_of_name(const emitters_error *e, size_t n_channels, lam_quantity quantity,
                                  const reduce_name *name, emitters_mix *mix, const double *mean) {
    const size_t s = e->figures.s, G = e->figures.n_groups;
    double area = 0, off = 0, elements2 = 0, reflected2 = 0, radiosity2 = 0;
    for (size_t k = 0; k < name->n_groups; k++) {
        const size_t g = name->groups[k];
        area += e->area[g];
        emitters_mix_find(e, g, mix);
        off += e->area[g] * sqrt(reflecting_of_mean(&e->black[g], quantity, mix->of_mean[g]));
        elements2 += reflecting_of_elements(&e->black[g], quantity, mix->of_group[g]);
    }
    if (!(area > 0)) return (name_error){.mean = 0};
    for (size_t c = 0; c < n_channels; c++) {
        double direct = 0, rho = 0;
        for (size_t k = 0; k < name->n_groups; k++) {
            const size_t g = name->groups[k];
            rho += e->area[g] / area * e->reflectance[c * G + g];
            for (size_t l = 0; l < s; l++)
                direct +=
                    e->area[g] / area * (double)mix->W[c * s + l] * e->exitance[c] * e->direct[g * s + l];
        }
        const bool irradiance = quantity == LAM_IRRADIANCE;
        const double r = mean[c] - (irradiance ? direct : quantity == LAM_RADIOSITY ? rho * direct : 0);
        reflected2 += r * r;
        radiosity2 += irradiance ? mean[c] * mean[c] : (r + rho * direct) * (r + rho * direct);
    }
    const double mean2 = off * off / (area * area);
    name_error made = error_of_squares(mean2, elements2 / area, reflected2, radiosity2);
    made.parts = parts_of(mean2, -1, reflected2, radiosity2);
    return made;
}
