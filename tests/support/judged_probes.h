/* Emissions and their indirect radiosity by a judge, for scenes that are too large for a dense reference:
 *     B - E = R H + D,  (I - R F') D = R F' (R H),
 * with H the light that E itself gives: of single elements pair by pair, of lamps (squares of a plane) by
 * some of their elements for each element, of random emission by F', as all that bounces on is. For drivers
 * that measure: they end with a message where anything fails. */
#ifndef LAMBERT_TESTS_SUPPORT_JUDGED_PROBES_H
#define LAMBERT_TESTS_SUPPORT_JUDGED_PROBES_H

#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/pairs/first_light.h"

enum { PROBES_MOST = 96 };
enum { PROBE_SINGLE, PROBE_LAMP, PROBE_RANDOM, PROBE_GROUPS };
extern const char *const probe_groups[PROBE_GROUPS];

typedef struct judged_probes {
    mesh m;
    uint32_t *order;
    first_light *first;
    size_t counts[PROBE_GROUPS], n_probes;
    float *E;      /* [n_probes][n] */
    double *right; /* [n_probes][n], R H */
    double *B;     /* [n_probes][n], less E */
} judged_probes;

/* F' is of the recipe `judging`. path, unless NULL, keeps the judgement for the next run. */
void judged_probes_make(const char *scene, const recipe *judging, const char *path,
                        const size_t counts[PROBE_GROUPS], judged_probes *out);
void judged_probes_free(judged_probes *b);

/* |x - B| / |B|, by area, of an answer x [n] to a probe, both less E. */
double judged_probes_error(const judged_probes *b, size_t probe, const float *indirect);

#endif
