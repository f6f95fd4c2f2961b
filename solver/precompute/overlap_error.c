/* The part of stated errors that faces which count twice make.
 *
 * Two faces that cover the same part of a plane both face the same elements, so that the rows of these sum to
 * more than 1 by the form factors of what is covered, and the repair takes from each of their form factors a
 * share r: half of what overlaps, over all area, is its mean, and the mean repair of rows is the same, or
 * more where faces cut through each other unseen. A bounce is off by the share r of its light, light of k
 * bounces by k r. The reflected light has 1 / (1 - rho) bounces on average, rho the mean reflectance, and at
 * least one; the geometric mean of both is taken, s = r / sqrt(1 - rho), at most 2 r as a closed scene keeps
 * its power: r = .16 made .13 to .29 of the light of walls in a room that reflects .7.
 *
 * Of the two faces one is in front and has that light, the other is dark, and nobody knows which: an element
 * that overlaps is off by its own light with probability 1/2. With o_g the share of a group's area that
 * overlaps, the squared error over the squared light L = B - E in it is s^2 + o_g / 2 of its elements and
 * s^2 + o_g^2 / 2 of its mean, and over the whole scene, o the share of its area, s^2 + o / 2. It adds up in
 * squares with the other errors, which are independent of it. */
#include "solver/precompute/stages.h"
#include "solver/scene/coincident.h"

#include <math.h>
#include <stdlib.h>

/* s by the overlap and by the repair of rows; there are no rows beside positions. */
static double repair_of(const precompute_scene *scene, const form_factors *f) {
    const mesh *m = &scene->m;
    const double overlap = mesh_overlap_share(m) / 2,
                 r = fmax(overlap, f != NULL && f->row_sums != NULL ? form_factors_repair_error(f) : 0);
    double most = 0, area = 0;
    if (!(r > 0)) return 0;
    for (size_t i = 0; i < m->n; i++) area += m->area[i];
    for (size_t c = 0; c < m->n_channels; c++) {
        double rho = 0;
        for (size_t i = 0; i < m->n; i++) rho += m->area[i] / area * (double)m->reflectance[c * m->n + i];
        most = fmax(most, rho);
    }
    return r * fmin(2, 1 / sqrt(1 - most));
}

static double elements2(const precompute_scene *scene, const made_operator *made, size_t group) {
    const double share = scene->m.overlap != NULL ? scene->m.overlap[group] : 0;
    return made->repair * made->repair + share / 2;
}

static double mean2(const precompute_scene *scene, const made_operator *made, size_t group) {
    const double share = scene->m.overlap != NULL ? scene->m.overlap[group] : 0;
    return made->repair * made->repair + share * share / 2;
}

static double whole2(const precompute_scene *scene, const made_operator *made) {
    return made->repair * made->repair + mesh_overlap_share(&scene->m) / 2;
}

/* relative = indirect |B - E| / |B|: what is added to the indirect error is less of B. */
static void add_to_figures(error_group *g, double added2) {
    const double share =
        g->total_indirect.mean > 0 ? fmin(1, g->total_relative.mean / g->total_indirect.mean) : 1;
    if (g->probes == 0) return;
    double *const indirect[] = {&g->total_indirect.mean, &g->total_indirect.max};
    double *const relative[] = {&g->total_relative.mean, &g->total_relative.max};
    for (int k = 0; k < 2; k++) {
        *indirect[k] = sqrt(*indirect[k] * *indirect[k] + added2);
        *relative[k] = sqrt(*relative[k] * *relative[k] + share * share * added2);
    }
    if (!g->receivers.known) return;
    receiver_figures *r = &g->receivers;
    const double of_read = r->total_indirect > 0 ? fmin(1, r->total_relative / r->total_indirect) : 1;
    r->total_indirect = sqrt(r->total_indirect * r->total_indirect + added2);
    r->total_relative = sqrt(r->total_relative * r->total_relative + of_read * of_read * added2);
}

static void add_to_groups(const precompute_scene *scene, const made_operator *made, group_errors *e) {
    static const int figures[] = {GROUP_UNIFORM, GROUP_UNIFORM_LARGEST, GROUP_NEAR, GROUP_NEAR_LARGEST,
                                  GROUP_FAR,     GROUP_FAR_LARGEST};
    for (size_t k = 0; k < sizeof figures / sizeof *figures && e->of[figures[k]] != NULL; k++)
        for (size_t b = 0; b < e->n_rows * e->n_groups; b++) {
            double *x = &e->of[figures[k]][b]; /* not a number where nothing is known */
            *x = sqrt(*x * *x + mean2(scene, made, b % e->n_groups));
        }
}

bool made_is_overlapping(const precompute_scene *scene, const made_operator *made) {
    const double error = judge_total(&made->errors.random);
    return made->repair > 0 && whole2(scene, made) > .5 * error * error;
}

void made_add_overlap(const precompute_job *job, const precompute_scene *scene, const precompute_plan *plan,
                      const precompute_factors *factors, made_operator *made) {
    error_report *e = &made->errors;
    error_group *const groups[] = {&e->single, &e->lights, &e->random, &e->whole, &e->sky};
    made->repair = repair_of(scene, &factors->f);
    if (!(made->repair > 0) || plan->probes == 0 || !e->has_total) return;
    for (size_t k = 0; k < sizeof groups / sizeof *groups; k++)
        add_to_figures(groups[k], whole2(scene, made));
    add_to_groups(scene, made, &made->by_group);
    /* The references have that fault, too, in a way of their own: the distance of one group's light to them
     * holds both, and says less than the law of sizes, which is of many lights. */
    if (scene->m.overlap != NULL) group_errors_drop_whole(&made->by_group);
    terminal_log(
        job->t,
        "faces that overlap, and the repair of row sums, are %.2g of the reflected light: stated errors "
        "contain it",
        sqrt(whole2(scene, made)));
}

/* Covariances of light that is off by the same share for all positions: share^2 times the products of their
 * light, of the elements of a group and of its mean. */
lam_status walked_add_overlap(const precompute_scene *scene, made_operator *made, const walked_light *walked,
                              lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = &scene->m;
    const reuse_estimates *e = &walked->paths;
    const size_t n = m->n, C = m->n_channels, s = e->n_positions, G = m->n_groups;
    double *area = NULL, *mean = NULL;
    made->repair = repair_of(scene, NULL);
    if (!(made->repair > 0)) return LAM_OK;
    area = memory_allocate(G, sizeof *area, "errors of positions", error);
    mean = memory_allocate(G, s * sizeof *mean, "errors of positions", error);
    if (area == NULL || mean == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) area[m->group[i]] += m->area[i];
    for (size_t c = 0; c < C; c++) {
        const float *rho = m->reflectance + c * n, *H = e->H + c * s * n;
        for (size_t k = 0; k < G * s; k++) mean[k] = 0;
        for (size_t i = 0; i < n; i++) {
            const size_t g = m->group[i];
            const double weight = m->area[i] * (double)rho[i] * (double)rho[i];
            for (size_t j = 0; j < s; j++) {
                const double here = (double)H[j * n + i];
                mean[g * s + j] += m->area[i] * (double)rho[i] * here / area[g];
                for (size_t l = 0; l < s; l++) {
                    const double product = weight * here * (double)H[l * n + i];
                    e->covariance[j * s + l] += elements2(scene, made, g) * product;
                    if (e->of_groups != NULL)
                        e->of_groups[(g * s + j) * s + l] += elements2(scene, made, g) * product;
                }
            }
        }
        for (size_t g = 0; e->of_means != NULL && g < G; g++)
            for (size_t j = 0; j < s; j++)
                for (size_t l = 0; l < s; l++)
                    e->of_means[(g * s + j) * s + l] +=
                        mean2(scene, made, g) * mean[g * s + j] * mean[g * s + l];
    }
done:
    free(area);
    free(mean);
    return status;
}
