#include "solver/method/judge/judge_probes.h"

#include "solver/base/random.h"
#include "solver/operator/emitters.h"

#include <stdlib.h>
#include <string.h>

/* True if the scene has light of its own that the operator can answer. */
static bool any_light(const lam_operator *op, const build_problem *problem, const float *emission,
                      const float *emits) {
    if (lam_operator_emitters(op) > 0) {
        const size_t count = lam_operator_emitters(op) * problem->n_channels;
        float *W = memory_allocate(count, sizeof *W, "weights", NULL);
        bool any = W != NULL && lam_operator_weights(op, 1, emission, 0, NULL, W, NULL) == LAM_OK,
             lit = false;
        for (size_t k = 0; any && k < count; k++) lit = lit || W[k] > 0;
        free(W);
        return any && lit;
    }
    for (size_t i = 0; i < problem->n * problem->n_channels; i++)
        if (emission[i] > 0 && (emits == NULL || emits[i % problem->n] > 0)) return true;
    return false;
}

lam_status probe_source_make(const build_problem *problem, const lam_operator *op, const float *emission,
                             const float *emits, size_t singles, size_t randoms, uint64_t seed,
                             probe_source *out, lam_error *error) {
    const size_t s = lam_operator_emitters(op), all = s > 0 ? s : problem->n;
    *out = (probe_source){
        .problem = problem,
        .op = op,
        .emission = emission,
        .emits = emits,
        .most = {[JUDGE_RANDOM] = randoms, [JUDGE_LIGHTS] = any_light(op, problem, emission, emits)},
        .draw = seed,
        .random = seed + 1};
    out->deck = memory_allocate(all, sizeof *out->deck, "probes", error);
    if (out->deck == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < all; k++)
        if (emits == NULL || emits[k] > 0) out->deck[out->n_singles++] = (uint32_t)k;
    out->most[JUDGE_SINGLE] = singles < out->n_singles ? singles : out->n_singles;
    return LAM_OK;
}

/* A group that may emit: whether people light it, the power of the scene's own light there, and its area. */
typedef struct ranked_group {
    uint32_t group;
    bool may, people;
    double power, area;
} ranked_group;

/* Groups that may emit first, of them the brightest, then those that people light, then the largest, then by
 * their numbers. */
static int compare_groups(const void *a, const void *b) {
    const ranked_group *x = a, *y = b;
    if (x->may != y->may) return x->may ? -1 : 1;
    if (x->power != y->power) return x->power > y->power ? -1 : 1;
    if (x->people != y->people) return x->people ? -1 : 1;
    if (x->area != y->area) return x->area > y->area ? -1 : 1;
    return x->group < y->group ? -1 : 1;
}

lam_status probe_source_add_groups(probe_source *s, const uint32_t *group, size_t n_groups,
                                   const bool *people, size_t large, size_t most, lam_error *error) {
    lam_status status = LAM_OK;
    const build_problem *p = s->problem;
    ranked_group *ranked = NULL;
    size_t lit = 0;
    if (lam_operator_emitters(s->op) > 0) return LAM_OK;
    ranked = memory_allocate(n_groups, sizeof *ranked, "probes", error);
    s->whole = memory_allocate(n_groups, sizeof *s->whole, "probes", error);
    if (ranked == NULL || s->whole == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t g = 0; g < n_groups; g++)
        ranked[g] = (ranked_group){.group = (uint32_t)g, .people = people != NULL && people[g]};
    for (size_t i = 0; i < p->n; i++) {
        ranked_group *of = &ranked[group[i]];
        if (s->emits != NULL && !(s->emits[i] > 0)) continue;
        of->may = true;
        of->area += p->area[i];
        for (size_t c = 0; c < p->n_channels; c++)
            of->power += p->area[i] * (double)s->emission[c * p->n + i];
    }
    qsort(ranked, n_groups, sizeof *ranked, compare_groups);
    for (size_t g = 0; g < n_groups && ranked[g].may; g++) {
        s->whole[s->n_whole++] = ranked[g].group;
        lit += s->emits != NULL || ranked[g].power > 0 || ranked[g].people;
    }
    s->group = group;
    s->most[JUDGE_WHOLE] = lit + large < most ? lit + large : most;
    if (s->n_whole < s->most[JUDGE_WHOLE]) s->most[JUDGE_WHOLE] = s->n_whole;
done:
    free(ranked);
    return status;
}

void probe_source_free(probe_source *s) {
    free(s->deck);
    free(s->whole);
    s->deck = s->whole = NULL;
}

size_t probe_source_all(const probe_source *s, int group) {
    if (group == JUDGE_RANDOM) return 0;
    return group == JUDGE_LIGHTS ? 1 : group == JUDGE_WHOLE ? s->n_whole : s->n_singles;
}

void probes_free(probes *p) {
    free(p->E);
    free(p->B);
    free(p->H);
    free(p->W);
    free(p->H0);
    *p = (probes){.m = 0};
}

/* Card v of a deck, v having been drawn before, without repetition. */
static size_t draw(uint32_t *deck, size_t count, size_t v, uint64_t *state) {
    const size_t other = v + (size_t)(random_unit(state) * (double)(count - v));
    const uint32_t drawn = deck[other];
    deck[other] = deck[v];
    deck[v] = drawn;
    return drawn;
}

/* numbers [C][count]: 1 at a drawn place or all over a drawn group, those of the scene's own light, or random
 * ones. */
static lam_status set_numbers(probe_source *s, int group, size_t count, float *numbers, lam_error *error) {
    const size_t C = s->problem->n_channels;
    if (group == JUDGE_SINGLE) {
        const size_t at = draw(s->deck, s->n_singles, s->made[group]++, &s->draw);
        for (size_t c = 0; c < C; c++) numbers[c * count + at] = 1;
        return LAM_OK;
    }
    const size_t v = s->made[group]++;
    if (group == JUDGE_WHOLE) {
        for (size_t k = 0; k < C * count; k++) numbers[k] = s->group[k % count] == s->whole[v];
    } else if (group == JUDGE_RANDOM)
        for (size_t k = 0; k < C * count; k++) numbers[k] = (float)random_unit(&s->random);
    else if (lam_operator_emitters(s->op) > 0)
        return lam_operator_weights(s->op, 1, s->emission, 0, NULL, numbers, error);
    else
        memcpy(numbers, s->emission, C * count * sizeof *numbers);
    for (size_t k = 0; s->emits != NULL && k < C * count; k++)
        if (!(s->emits[k % count] > 0)) numbers[k] = 0;
    return LAM_OK;
}

/* out = quantity of the operator for every probe, a few at a time. */
static lam_status apply(const lam_operator *op, const probes *p, lam_quantity quantity, float *out,
                        lam_error *error) {
    enum { AT_ONCE = 16 };
    lam_status status = LAM_OK;
    const size_t vector = lam_operator_elements(op) * lam_operator_channels(op);
    const size_t n_batches = (p->m + AT_ONCE - 1) / AT_ONCE;
    const size_t bytes = lam_operator_work_bytes(op, AT_ONCE);
#pragma omp parallel for schedule(dynamic, 1) if (n_batches > 1)
    for (size_t b = 0; b < n_batches; b++) {
        const size_t first = b * AT_ONCE, count = p->m - first < AT_ONCE ? p->m - first : AT_ONCE;
        lam_error one = {0};
        void *work = memory_allocate(1, bytes, "work area", &one);
        lam_status result = LAM_ERR_MEMORY;
        if (work != NULL && p->W != NULL)
            result = lam_operator_apply_emitters(
                op, count, quantity, p->W + first * lam_operator_emitters(op) * lam_operator_channels(op), 0,
                NULL, out + first * vector, work, bytes, &one);
        else if (work != NULL)
            result = lam_operator_apply(op, count, quantity, p->E + first * vector, out + first * vector,
                                        work, bytes, &one);
        free(work);
        if (result != LAM_OK) {
#pragma omp critical(judge_apply)
            {
                status = result;
                if (error != NULL) *error = one;
            }
        }
    }
    return status;
}

lam_status probes_next(probe_source *source, const size_t counts[JUDGE_GROUPS], bool irradiance, probes *out,
                       lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = source->problem->n, C = source->problem->n_channels, vector = n * C;
    const size_t s = lam_operator_emitters(source->op);
    probes p = {.m = 0};
    for (int g = 0; g < JUDGE_GROUPS; g++) p.begin[g + 1] = p.begin[g] + counts[g];
    p.m = p.begin[JUDGE_GROUPS];
    p.E = memory_allocate(p.m, vector * sizeof *p.E, "probes", error);
    p.B = memory_allocate(p.m, vector * sizeof *p.B, "probes", error);
    if (p.E == NULL || p.B == NULL) TRY(LAM_ERR_MEMORY);
    if (irradiance || source->black != NULL) {
        p.H = memory_allocate(p.m, vector * sizeof *p.H, "probes", error);
        if (p.H == NULL) TRY(LAM_ERR_MEMORY);
    }
    if (s > 0) {
        p.W = memory_allocate(p.m, s * C * sizeof *p.W, "probes", error);
        p.H0 = memory_allocate(p.m, vector * sizeof *p.H0, "probes", error);
        if (p.W == NULL || p.H0 == NULL) TRY(LAM_ERR_MEMORY);
    }
    for (int g = 0; g < JUDGE_GROUPS; g++)
        for (size_t v = p.begin[g]; v < p.begin[g + 1]; v++)
            TRY(set_numbers(source, g, s > 0 ? s : n, s > 0 ? p.W + v * s * C : p.E + v * vector, error));
    if (s > 0) {
        TRY(operator_emitters_light(source->op, p.m, p.W, p.E, p.H0, error));
        for (size_t v = 0; v < p.m; v++)
            for (size_t i = 0; i < vector; i++)
                p.E[v * vector + i] += source->problem->reflectance[i] * p.H0[v * vector + i];
    }
    TRY(apply(source->op, &p, LAM_RADIOSITY, p.B, error));
    if (p.H != NULL) TRY(apply(source->op, &p, LAM_IRRADIANCE, p.H, error));
    for (size_t k = 0; source->black != NULL && k < p.m * vector; k++)
        if (source->black[k % n]) p.B[k] = p.H[k];
    if (!irradiance) {
        free(p.H);
        p.H = NULL;
    }
    *out = p;
    p = (probes){.m = 0};
done:
    probes_free(&p);
    return status;
}
