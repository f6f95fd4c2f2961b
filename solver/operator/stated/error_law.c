#include "solver/operator/stated/error_law.h"

#include "solver/base/weighted.h"
#include "solver/operator/stated/whole_law.h"
#include "store/groups.h"
#include "store/status.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void error_by_group_free(error_by_group *e) {
    group_errors_free(&e->figures);
    free(e->area);
    free(e->squares);
    free(e->reflectance);
    free(e->of_group);
    free(e->bin);
    free(e->overlap);
    free(e->whole_of);
    mesh_shares_free(&e->mesh);
    *e = (error_by_group){.n_bins = 0};
}

/* The areas of bins, the squares of groups, and their mean reflectances. */
static void find_sums(const error_scene *scene, error_by_group *e) {
    const size_t G = scene->n_groups;
    for (size_t g = 0; g < G; g++) {
        double area = 0;
        for (uint32_t k = scene->start[g]; k < scene->start[g + 1]; k++) {
            const size_t i = scene->members[k];
            const bool other = scene->read != NULL && !scene->read[i] && e->n_bins > G;
            const size_t bin = g + (other ? G : 0);
            e->bin[i] = (uint32_t)bin;
            e->area[bin] += scene->area[i];
            e->squares[g] += scene->area[i] * scene->area[i];
            area += scene->area[i];
            for (size_t c = 0; c < scene->n_channels; c++)
                e->reflectance[c * G + g] += scene->area[i] * (double)scene->reflectance[c * scene->n + i];
        }
        for (size_t c = 0; area > 0 && c < scene->n_channels; c++) e->reflectance[c * G + g] /= area;
    }
}

/* Makes of_group for groups, whose bins of row 0 have their numbers. */
static lam_status find_reflecting(const error_scene *scene, error_by_group *e, lam_error *error) {
    uint32_t *group = memory_allocate(scene->n, sizeof *group, "errors of groups", error);
    if (group == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < scene->n; i++) group[i] = (uint32_t)(e->bin[i] % scene->n_groups);
    const lam_status status = reflecting_make(scene->n, scene->n_channels, scene->area, scene->reflectance,
                                              scene->n_groups, group, &e->of_group, error);
    free(group);
    return status;
}

/* The places of groups among those whose errors are stated together. */
static lam_status find_whole(error_by_group *e, lam_error *error) {
    const group_errors *f = &e->figures;
    if (f->n_whole == 0) return LAM_OK;
    e->whole_of = memory_allocate(f->n_groups, sizeof *e->whole_of, "errors of groups", error);
    if (e->whole_of == NULL) return LAM_ERR_MEMORY;
    for (size_t g = 0; g < f->n_groups; g++) e->whole_of[g] = WHOLE_NONE;
    for (size_t k = 0; k < f->n_whole; k++) e->whole_of[f->whole_groups[k]] = (uint32_t)k;
    return LAM_OK;
}

lam_status error_overlap_load(store *s, size_t n_groups, double **out, lam_error *error) {
    lam_status status = LAM_OK;
    void *data = NULL;
    double *overlap = NULL;
    *out = NULL;
    if (!store_has(s, STORE_MESH "/overlap")) return LAM_OK;
    TRY(store_read(s, STORE_MESH "/overlap", STORE_F64, 1, &n_groups, &data, error));
    overlap = data;
    for (size_t g = 0; g < n_groups; g++)
        if (!(overlap[g] >= 0 && overlap[g] <= 1))
            FAIL(error, LAM_ERR_FORMAT, "%s: " STORE_MESH "/overlap[%zu] = %g, must be from 0 to 1",
                 store_path(s), g, overlap[g]);
    *out = overlap;
    data = NULL;
done:
    free(data);
    return status;
}

/* The effective number of tiles of an even sky; 0: nothing is stated of skies. */
static double even_tiles(const group_errors *e) {
    double power2 = 0, squares = 0;
    for (size_t c = 0; e->sky_power != NULL && c < e->n_channels; c++) {
        double power = 0;
        for (size_t t = 0; t < e->n_tiles; t++) {
            const double Q = e->sky_power[c * e->n_tiles + t];
            power += Q;
            squares += Q * Q;
        }
        power2 += power * power;
    }
    return squares > 0 ? power2 / squares : 0;
}

lam_status error_by_group_make(const error_scene *scene, const double *overlap, stated_figures *from,
                               error_by_group *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t G = scene->n_groups;
    double *group_area = NULL;
    error_by_group e = {
        .figures = from->by_group, .n_bins = from->by_group.n_rows * G, .repair = from->repair};
    *out = (error_by_group){.n_bins = 0};
    if (e.n_bins == 0) return LAM_OK;
    from->by_group = (group_errors){.n_rows = 0};
    e.figures.n_channels = scene->n_channels; /* of a judge without a sky it is 0 */
    if (overlap != NULL) {
        e.overlap = memory_allocate(G, sizeof *e.overlap, "errors of groups", error);
        if (e.overlap == NULL) TRY(LAM_ERR_MEMORY);
        memcpy(e.overlap, overlap, G * sizeof *overlap);
    }
    e.area = memory_allocate(e.n_bins, sizeof *e.area, "errors of groups", error);
    e.squares = memory_allocate(G, sizeof *e.squares, "errors of groups", error);
    e.reflectance = memory_allocate(G, scene->n_channels * sizeof *e.reflectance, "errors of groups", error);
    e.bin = memory_allocate(scene->n, sizeof *e.bin, "errors of groups", error);
    if (e.area == NULL || e.squares == NULL || e.reflectance == NULL || e.bin == NULL) TRY(LAM_ERR_MEMORY);
    find_sums(scene, &e);
    TRY(find_reflecting(scene, &e, error));
    TRY(find_whole(&e, error));
    group_area = memory_allocate(G, sizeof *group_area, "errors of groups", error);
    if (group_area == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t b = 0; b < e.n_bins; b++) group_area[b % G] += e.area[b];
    TRY(mesh_shares_make(&from->mesh, G, group_area, even_tiles(&e.figures), &e.mesh, error));
    *out = e;
    e = (error_by_group){.n_bins = 0};
done:
    error_by_group_free(&e);
    free(group_area);
    return status;
}

double emission_size_number(const emission_size *e) {
    return e->squares > 0 ? e->power2 / e->squares : 0;
}

void emission_size_add(emission_size *e, size_t n, const double *weights, const float *E) {
    double power = 0, squares = 0;
    for (size_t i = 0; i < n; i++) {
        const double flux = fabs(weights[i] * (double)E[i]);
        power += flux;
        squares += flux * flux;
    }
    e->power2 += power * power;
    e->squares += squares;
}

emission_size emission_size_sum(const emission_size *a, const emission_size *b) {
    const double power = sqrt(a->power2) + sqrt(b->power2);
    return (emission_size){power * power, a->squares + b->squares, a->lamps2 + b->lamps2};
}

/* P^2 (one^2 / N^2 + many^2 (1 - 1/N) / N + even^2): the square of an error. */
static double error2(const emission_size *size, double one, double many, double even) {
    const double share = size->power2 > 0 ? size->squares / size->power2 : 1; /* 1 / N */
    return size->power2 *
           (one * one * share * share + many * many * share * fmax(0, 1 - share) + even * even);
}

/* The same of a bin by its law, whose three figures begin with GROUP_MEAN_ONE or GROUP_RMS_ONE. */
static double emission2(const error_by_group *e, const emission_size *size, size_t bin, int first) {
    double *const *of = e->figures.of;
    return error2(size, of[first][bin], of[first + 1][bin], of[first + 2][bin]);
}

static weighted_sums sky_channel(const group_errors *e, const float *L, size_t c) {
    return weighted_sums_of(e->n_tiles, e->sky_power + c * e->n_tiles, L + c * e->n_tiles);
}

sky_sizes sky_sizes_of(const error_by_group *by, const float *L) {
    const group_errors *e = &by->figures;
    sky_sizes of = {.L = e->n_tiles > 0 ? L : NULL};
    for (size_t c = 0; of.L != NULL && c < e->n_channels; c++) {
        const weighted_sums sums = sky_channel(e, L, c);
        of.power2 += sums.sum * sums.sum;
        of.spread += sums.spread;
        of.squares += sums.squares;
        of.power_off +=
            weighted_spread(e->n_tiles, e->sky_power_off + c * e->n_tiles, L + c * e->n_tiles, sums.mean);
    }
    return of;
}

light_sizes light_sizes_of(const error_by_group *e, lam_quantity quantity, const emission_size *size,
                           const float *L) {
    light_sizes of = {.quantity = quantity, .size = *size};
    *(quantity == LAM_INDIRECT ? &of.sent : &of.sky) = sky_sizes_of(e, L);
    return of;
}

/* D of a group by weights of its tiles, [n_groups][n_tiles]; 0 where these are NULL. Of irradiance, which is
 * what stores state where nothing is reflected, rho is 1. */
static double direct_of(const error_by_group *by, const double *weights, const light_sizes *of,
                        size_t group) {
    const group_errors *e = &by->figures;
    const size_t m = e->n_tiles;
    const float *L = of->sky.L;
    const bool as_white = of->quantity == LAM_IRRADIANCE;
    double sum = 0;
    for (size_t c = 0; weights != NULL && c < e->n_channels; c++) {
        const double rho = as_white ? 1 : by->reflectance[c * e->n_groups + group];
        const double spread = weighted_spread(m, weights + group * m, L + c * m, sky_channel(e, L, c).mean);
        sum += rho * rho * spread;
    }
    return sum;
}

/* The part of the direct light of single tiles, and of luminaires. */
static bin_error error_of_direct(const error_by_group *e, const light_sizes *of, size_t bin) {
    const size_t C = e->figures.n_channels, G = e->figures.n_groups, group = bin % G;
    const lit_luminaires *lit = of->quantity == LAM_INDIRECT ? &(lit_luminaires){.k = 0} : &of->luminaires;
    const double *rho = of->quantity == LAM_IRRADIANCE ? NULL : e->reflectance;
    bin_error sum = {luminaire_law(lit, lit->elements_off, C, G, group, rho),
                     luminaire_law(lit, lit->means_off, C, G, group, rho)};
    if (of->sky.L == NULL) return sum;
    sum.elements2 += direct_of(e, e->figures.sky_elements_off, of, group);
    sum.mean2 += direct_of(e, e->figures.sky_means_off, of, group);
    return sum;
}

/* A law of a sky beside its direct light, whose three figures begin with SKY_MEAN_TILES or SKY_RMS_TILES:
 * what single tiles are off by beyond it, and an even sky. 0 where there is no sky. */
static double sky2(const error_by_group *e, const sky_sizes *of, size_t bin, int first) {
    double *const *sky = e->figures.sky + first;
    if (of->L == NULL) return 0;
    const double tiles = sky[0][bin], even = sky[1][bin], bounced = sky[2][bin];
    return bounced * bounced * of->power_off + tiles * tiles * of->spread + even * even * of->power2;
}

/* That of the light of a sky that is reflected alone: what the power is off by that it sends into the scene,
 * W and, of an even sky, the errors of the means of groups as if independent; and the law of an emission of
 * that power from all elements. It is at most what the law of skies says of all their light. */
static void add_sent(const error_by_group *e, const light_sizes *of, size_t bin, bin_error *sum) {
    double *const *sky = e->figures.sky;
    const size_t G = e->figures.n_groups;
    double area = 0, squares = 0, off2 = of->sent.power_off + of->lost2;
    if (of->sent.L == NULL) return;
    for (size_t b = 0; b < e->n_bins; b++) {
        const double flux = e->of_group[b % G].black ? 0 : e->area[b] * sky[SKY_MEAN_EVEN][b];
        off2 += flux * flux * of->sent.power2;
        area += e->area[b];
    }
    for (size_t g = 0; g < G; g++) squares += e->squares[g];
    const emission_size size = {of->sent.power2, area > 0 ? of->sent.power2 * squares / (area * area) : 0, 0};
    const double rms = sky[SKY_RMS_BOUNCED][bin], mean = sky[SKY_MEAN_BOUNCED][bin];
    sum->elements2 += fmin(sky2(e, &of->sent, bin, SKY_RMS_TILES),
                           rms * rms * off2 + emission2(e, &size, bin, GROUP_RMS_ONE));
    sum->mean2 += fmin(sky2(e, &of->sent, bin, SKY_MEAN_TILES),
                       mean * mean * off2 + emission2(e, &size, bin, GROUP_MEAN_ONE));
}

bin_error error_law(const error_by_group *e, const light_sizes *of, size_t bin) {
    const reflecting *group = &e->of_group[bin % e->figures.n_groups];
    if (group->black && of->quantity != LAM_IRRADIANCE) return (bin_error){0, 0};
    const bin_error direct = error_of_direct(e, of, bin);
    const bool whole = of->whole.weights != NULL;
    const emission_size *rest = whole ? &of->whole.rest : &of->size;
    bin_error sum = whole ? whole_law(e, of->whole.weights, bin) : (bin_error){0, 0};
    sum.elements2 += emission2(e, rest, bin, GROUP_RMS_ONE);
    sum.mean2 += emission2(e, rest, bin, GROUP_MEAN_ONE);
    sum.elements2 += sky2(e, &of->sky, bin, SKY_RMS_TILES);
    sum.mean2 += sky2(e, &of->sky, bin, SKY_MEAN_TILES);
    add_sent(e, of, bin, &sum);
    return (bin_error){reflecting_of_elements(group, of->quantity, sum.elements2) + direct.elements2,
                       reflecting_of_mean(group, of->quantity, sum.mean2) + direct.mean2};
}

double error_ratio(double error2, double light2) {
    if (!(error2 > 0)) return 0;
    return sqrt(2 * error2 < light2 ? error2 / (light2 - error2) : 2 * error2 / light2);
}

bool mesh_is_stated(const error_by_group *e) {
    return mesh_shares_known(&e->mesh);
}

bool mesh_lamps_in(const error_by_group *e, size_t bin) {
    return e->mesh.lamps != NULL && e->mesh.lamps[bin % e->figures.n_groups];
}

mesh_lack mesh_lack_of_bin(const error_by_group *e, const light_sizes *of, size_t bin) {
    const double squares = of->sky.squares + of->sent.squares, power = sqrt(of->size.power2);
    const bool knows_whole = of->whole.weights != NULL;
    const emission_size *others = knows_whole ? &of->whole.rest : &of->size;
    const double of_lamps = sqrt(of->size.lamps2), of_luminaires = sqrt(of->luminaires.power2);
    const mesh_light light = {.power = fmax(power - of_luminaires, 0),
                              .of_lamps = of_lamps,
                              .of_whole = knows_whole ? fmax(power - of_lamps - sqrt(others->power2), 0) : 0,
                              .luminaire_power = of_luminaires,
                              .luminaires = lit_luminaires_number(&of->luminaires, e->figures.n_channels),
                              .emitters = emission_size_number(&of->size),
                              .others = emission_size_number(others),
                              .sky_power = sqrt(of->sky.power2) + sqrt(of->sent.power2),
                              .sky_tiles = squares > 0 ? (of->sky.power2 + of->sent.power2) / squares : 0,
                              .bounced = of->quantity == LAM_INDIRECT,
                              .whole = of->whole.mesh};
    return mesh_lack_of(&e->mesh, &light, bin % e->figures.n_groups);
}

double overlap_of_bin(const error_by_group *e, size_t bin) {
    return e->overlap != NULL ? e->overlap[bin % e->figures.n_groups] : 0;
}

double overlap_elements2(const error_by_group *e, size_t bin) {
    return e->repair * e->repair + overlap_of_bin(e, bin) / 2;
}

double overlap_mean2(const error_by_group *e, double light, double covered) {
    return e->repair * e->repair * light * light + covered * covered / 2;
}
