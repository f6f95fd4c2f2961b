#include "solver/method/judge/judge_round.h"

#include "solver/method/judge/judge_emitters.h"
#include "solver/method/judge/judge_whole.h"

#include <stdlib.h>
#include <string.h>

/* Probes of a group are enough where the standard error of their mean is below this share of it. */
static const double certain = .1;
/* Random emissions are all alike. Where the references are no twins the noise is measured by some of the
 * first round: random emission, whole groups, the lights, and some single elements. */
enum { NOISE_PROBES = 12 };
/* The first light of a group takes as long as that of all of its elements one by one: it is found for groups
 * of so few of them, as of single elements the samples have little of it, and for no more than these in all.
 */
enum { FIRST_OF_GROUP = 32, FIRST_OF_ALL = 128 };

/* The emissions of a round, their first light H and its spread D, [m][C][n], and corrections by each
 * reference, in single precision, as the answers are that they correct. */
typedef struct measured {
    const judge_input *input;
    const probes *p;
    double *first, *spread;
    bool *known;
    float *x, *y;          /* y: by the other reference; NULL: of none */
    double *one_x, *one_y; /* [C][n] those of one probe */
} measured;

static void measured_free(measured *m) {
    free(m->first);
    free(m->spread);
    free(m->known);
    free(m->x);
    free(m->y);
    free(m->one_x);
    free(m->one_y);
}

static size_t vector_of(const judge_input *input) {
    return input->problem->n * input->problem->n_channels;
}

/* The elements that emit in a probe. */
static size_t count_emitters(const measured *m, size_t v) {
    const size_t n = m->input->problem->n;
    size_t count = 0;
    for (size_t i = 0; i < n; i++) count += m->p->E[v * vector_of(m->input) + i] > 0;
    return count;
}

/* Fills m->first, m->spread and m->known with H, D and *known of input->first_light (judge.h), for probes of
 * small groups, the scene's light and of single elements: H = F E is the first light of a probe, and D is
 * half the difference of two independent estimates whose mean is H. known[v] is false where so many elements
 * of probe v emit that neither is found. A channel with the emission of the first one gets its H and D. */
static lam_status find_first_light(measured *m, lam_error *error) {
    lam_status status = LAM_OK;
    const judge_input *input = m->input;
    const size_t n = input->problem->n, C = input->problem->n_channels;
    if (input->first_light == NULL || m->p->W != NULL) return LAM_OK;
    m->first = memory_allocate(m->p->m, C * n * sizeof *m->first, "probes", error);
    m->spread = memory_allocate(m->p->m, C * n * sizeof *m->spread, "probes", error);
    m->known = memory_allocate(m->p->m, sizeof *m->known, "probes", error);
    if (m->first == NULL || m->spread == NULL || m->known == NULL) TRY(LAM_ERR_MEMORY);
    size_t left = FIRST_OF_ALL;
    for (size_t v = m->p->begin[JUDGE_WHOLE]; v < m->p->m; v++) {
        const size_t emitters = v < m->p->begin[JUDGE_LIGHTS] ? count_emitters(m, v) : 0;
        if (emitters > FIRST_OF_GROUP || emitters > left) continue;
        left -= emitters;
        if (progress_cancelled(input->progress)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
        for (size_t c = 0; c < C; c++) {
            const float *E = m->p->E + v * C * n;
            double *H = m->first + v * C * n, *D = m->spread + v * C * n;
            if (c > 0 && memcmp(E, E + c * n, n * sizeof *E) == 0) {
                memcpy(H + c * n, H, n * sizeof *H);
                memcpy(D + c * n, D, n * sizeof *D);
                continue;
            }
            TRY(input->first_light(input->first_light_context, E + c * n, H + c * n, D + c * n, &m->known[v],
                                   error));
            if (!m->known[v]) break;
        }
    }
done:
    return status;
}

reference_system reference_system_of(const judge_input *input, const factor_product *F) {
    const build_problem *problem = input->problem;
    return (reference_system){.n = problem->n,
                              .n_channels = problem->n_channels,
                              .F = F,
                              .area = problem->area,
                              .reflectance = problem->reflectance,
                              .black = input->black};
}

typedef struct corrections {
    const judge_input *input;
    float *x; /* [m][C][n] */
} corrections;

static void keep(void *context, size_t v, size_t channel, const double *x) {
    const corrections *to = context;
    const size_t n = to->input->problem->n, C = to->input->problem->n_channels;
    float *out = to->x + (v * C + channel) * n;
    for (size_t i = 0; i < n; i++) out[i] = (float)x[i];
}

/* The share of D in the first light H of the independent reference or of the other one: of twins each has an
 * estimate of its own, H + D and H - D, and a disturbed one has as much of that noise as H itself. Their
 * distance then has the noise of the first light, and all that bounces on of it. */
static double share_of_spread(const judge_input *input, bool other) {
    if (input->other.n == 0 || input->relation == REFERENCE_COARSER) return 0;
    return input->relation == REFERENCE_TWIN ? (other ? -1 : 1) : (other ? 1 : 0);
}

/* x [][C][n]: corrections of the answers which[count] by F, the other reference or not; first: with the first
 * light that is known. */
static lam_status solve(const lam_operator *op, const measured *m, const factor_product *F, bool first,
                        bool other, size_t count, const size_t *which, double *rate, float *x,
                        lam_error *error) {
    const reference_system system = reference_system_of(m->input, F);
    const reference_answers answers = {.op = op,
                                       .E = m->p->E,
                                       .B = m->p->B,
                                       .direct = m->p->H0,
                                       .first = first ? m->first : NULL,
                                       .known = m->known,
                                       .spread = m->spread,
                                       .share = share_of_spread(m->input, other),
                                       .rate = rate,
                                       .progress = m->input->progress};
    corrections to = {m->input, x};
    return guided_reference_each(&system, &answers, count, which, keep, &to, error);
}

/* y of the first n_noisy answers, by the other reference. Where that is the operator's own F, x has the
 * corrections by it as long as no first light is taken, which are those of answers whose first light is not
 * known. */
static lam_status prepare_other(measured *m, size_t n_noisy, bool by_own, size_t *which, size_t *count,
                                lam_error *error) {
    const size_t vector = vector_of(m->input);
    *count = 0;
    m->y = memory_allocate(n_noisy, vector * sizeof *m->y, "reference", error);
    if (m->y == NULL) return LAM_ERR_MEMORY;
    for (size_t v = 0; v < n_noisy; v++)
        if (!by_own || (m->known != NULL && m->known[v]))
            which[(*count)++] = v;
        else
            memcpy(m->y + v * vector, m->x + v * vector, vector * sizeof *m->y);
    return LAM_OK;
}

/* The numbers of probe v, of from [][C][n], as to [C][n]. */
static const double *numbers_of(const measured *m, size_t v, const float *from, double *to) {
    const size_t vector = vector_of(m->input);
    for (size_t i = 0; i < vector; i++) to[i] = (double)from[v * vector + i];
    return to;
}

/* Probe v with its corrections x and y (NULL: not known), by the references of the total error or by the
 * operator's own; until the next one. The noise of the first light is a part of y - x or comes beside
 * (share_of_spread). */
static figure_probe probe_of(const measured *m, size_t v, const float *x, const float *y, bool total) {
    const judge_input *input = m->input;
    const size_t first = v * vector_of(input);
    const bool apart = input->other.n == 0 || input->relation == REFERENCE_COARSER;
    const bool spread = total && apart && m->known != NULL && m->known[v];
    return (figure_probe){.problem = input->problem,
                          .E = m->p->E + first,
                          .B = m->p->B + first,
                          .x = numbers_of(m, v, x, m->one_x),
                          .y = y != NULL ? numbers_of(m, v, y, m->one_y) : NULL,
                          .spread = spread ? m->spread + first : NULL,
                          .black = input->black,
                          .all_black = input->all_black,
                          .direct = m->p->H0 != NULL ? m->p->H0 + first : NULL,
                          .relation = input->relation,
                          .other_share = input->other_share};
}

static bool are_same(const factor_product *a, const factor_product *b) {
    return a->context == b->context && a->multiply == b->multiply;
}

bool judge_is_certain(const figure_tally *t, size_t all) {
    const double spread = figures_spread(t, all);
    return spread >= 0 && spread * (double)t->count <= certain * t->plain.f;
}

/* Nobody knows how many rounds there will be. */
static void report(const judge_rounds *r, double part) {
    progress_report(r->input->progress, "judge", 1 - 1 / ((double)r->n + 1 + part));
}

/* The light of what is read: of black elements their irradiance where such alone are read. */
static void add_receivers(const judge_input *input, const figure_probe *one, receiver_sums *to) {
    figure_probe read = *one;
    read.all_black = input->black_read;
    if (input->read != NULL) receivers_add(&read, input->read, to);
}

/* The corrections x by the operator's own F into all sums of its errors. */
static void add_own(const measured *m, judge_rounds *r) {
    const probes *p = m->p;
    for (int g = 0; g < JUDGE_GROUPS; g++)
        for (size_t v = p->begin[g]; v < p->begin[g + 1]; v++) {
            const figure_probe one = probe_of(m, v, m->x, NULL, false);
            figures_add(&one, &r->of[g].own);
            if (r->by_group.own.n > 0) by_group_add(&one, g, &r->by_group.own);
            add_receivers(m->input, &one, &r->of[g].own_receivers);
            r->of[g].n_operator++;
        }
}

void judge_rounds_add_total(judge_rounds *r, int group, const figure_probe *one) {
    figures_add(one, &r->of[group].total);
    add_receivers(r->input, one, &r->of[group].total_receivers);
}

/* The corrections x by the independent reference, and y of the first n_noisy by the other one, into all sums
 * of total errors; same: into those of the probes whose errors against the operator's own F are found, too;
 * lit: errors of the first bounce are figures of the whole scene, too, and these are found elsewhere. */
static void add_total(const measured *m, size_t n_noisy, bool same, bool lit, judge_rounds *r) {
    const probes *p = m->p;
    for (int g = 0; g < JUDGE_GROUPS; g++)
        for (size_t v = p->begin[g]; v < p->begin[g + 1]; v++) {
            const figure_probe one = probe_of(m, v, m->x, v < n_noisy ? m->y : NULL, true);
            if (!lit) judge_rounds_add_total(r, g, &one);
            if (r->by_group.total.n > 0) by_group_add(&one, g, &r->by_group.total);
            if (r->by_group.total.n > 0 && same) by_group_add(&one, g, &r->by_group.same);
        }
}

/* The figures of whole groups. Corrections are copied as numbers in double, [count][C][n] by each reference.
 */
static lam_status add_whole(const measured *m, size_t n_noisy, const probe_source *source, judge_rounds *r,
                            lam_error *error) {
    lam_status status = LAM_OK;
    const size_t first = m->p->begin[JUDGE_WHOLE], count = m->p->begin[JUDGE_WHOLE + 1] - first;
    const size_t vector = vector_of(m->input);
    figure_probe *each = NULL;
    double *numbers = NULL;
    if (r->whole == NULL || count == 0) return LAM_OK;
    each = memory_allocate(count, sizeof *each, "errors of groups", error);
    numbers = memory_allocate(2 * count, vector * sizeof *numbers, "errors of groups", error);
    if (each == NULL || numbers == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < count; k++) {
        double *const x = numbers + 2 * k * vector, *const y = x + vector;
        const size_t v = first + k;
        each[k] = probe_of(m, v, m->x, v < n_noisy ? m->y : NULL, true);
        each[k].x = numbers_of(m, v, m->x, x);
        if (each[k].y != NULL) each[k].y = numbers_of(m, v, m->y, y);
    }
    TRY(whole_errors(count, each, source->whole + source->made[JUDGE_WHOLE] - count, &r->by_group.total,
                     r->whole, error));
done:
    free(each);
    free(numbers);
    return status;
}

lam_status judge_rounds_add(const lam_operator *op, const probe_source *source, const probes *p,
                            judge_rounds *r, lam_error *error) {
    lam_status status = LAM_OK;
    const judge_input *input = r->input;
    measured m = {.input = input, .p = p};
    const bool first = r->n == 0, each = input->relation != REFERENCE_COARSER;
    const bool noisy = input->other.n > 0 && (first || each), by_own = are_same(&input->other, &input->own);
    const bool own =
        first || !judge_is_certain(&r->of[JUDGE_SINGLE].own.indirect, probe_source_all(source, JUDGE_SINGLE));
    const size_t some = NOISE_PROBES + p->begin[JUDGE_LIGHTS] - p->begin[JUDGE_WHOLE];
    const size_t n_noisy = !noisy ? 0 : each || r->at_once || p->m < some ? p->m : some;
    size_t *all = memory_allocate(p->m, sizeof *all, "probes", error);
    size_t *others = memory_allocate(p->m, sizeof *others, "probes", error), n_others = 0;
    m.x = memory_allocate(p->m, vector_of(input) * sizeof *m.x, "reference", error);
    m.one_x = memory_allocate(vector_of(input), sizeof *m.one_x, "reference", error);
    m.one_y = memory_allocate(vector_of(input), sizeof *m.one_y, "reference", error);
    if (m.x == NULL || m.one_x == NULL || m.one_y == NULL || all == NULL || others == NULL)
        TRY(LAM_ERR_MEMORY);
    for (size_t v = 0; v < p->m; v++) all[v] = v;
    if (own) {
        TRY(solve(op, &m, &input->own, false, false, p->m, all, &r->rates.own, m.x, error));
        add_own(&m, r);
    }
    if (input->independent.n > 0) {
        report(r, .3);
        TRY(find_first_light(&m, error));
        if (noisy) TRY(prepare_other(&m, n_noisy, own && by_own, others, &n_others, error));
        TRY(solve(op, &m, &input->independent, true, false, p->m, all, &r->rates.independent, m.x, error));
        report(r, .6);
        if (n_others > 0)
            TRY(solve(op, &m, &input->other, true, true, n_others, others,
                      by_own ? &r->rates.own : &r->rates.other, m.y, error));
        const bool lit = judge_emitters_are_lit(op, input);
        if (lit) TRY(judge_emitters_add(op, p, r, error));
        add_total(&m, n_noisy, own, lit, r);
        TRY(add_whole(&m, n_noisy, source, r, error));
    }
    for (int g = 0; g < JUDGE_GROUPS; g++) r->of[g].done += p->begin[g + 1] - p->begin[g];
    report(r, 1);
    r->n++;
done:
    free(all);
    free(others);
    measured_free(&m);
    return status;
}
