#include "solver/direct/direct_elements.h"

#include "solver/base/parallel_reported.h"
#include "solver/base/vector3.h"
#include "solver/direct/element_light.h"
#include "solver/direct/luminaire_runs.h"
#include "solver/formfactor/visibility/sample.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Elements between two looks at the progress; segments of each, where the options do not say, and beside
 * those that are partly hidden. */
enum { ELEMENTS_AT_ONCE = 64, SEGMENTS = 16, MORE_SEGMENTS = 256, BESIDE = 64, SEGMENTS_MOST = 4096 };

/* Panes pass light by its angle: shares that differ by less are one. */
static const double same_share = .02;

/* The findings of few segments on an element: nothing is hidden, or all, or a part; or it receives no light.
 */
enum { UNLIT, CLEAR = 1, DARK = 2, PARTLY = 3 };

/* One luminaire. */
typedef struct element_run {
    const mesh *m;
    const direct_options *options;
    const luminaire_run *luminaire;
    size_t segments, more, n_rows;
    double *open;           /* [n], lx where nothing hides */
    float *H, *off;         /* [n], lx and its squared error */
    unsigned char *found;   /* [n]: UNLIT ... */
    unsigned char *corners; /* [n_vertices]: what elements at a vertex found, CLEAR | DARK */
} element_run;

/* The shares V of the light that pass along the segments of an element, in two halves with samples of their
 * own. */
typedef struct segment_set {
    element_sampler sampler;
    pair_sampler places[2];
    size_t n;                     /* in both halves */
    double passed[SEGMENTS_MOST]; /* [2][n / 2] */
} segment_set;

/* A place of the element and one of the opening for each segment of a packet. In the scene: x; in the frame
 * of the luminaire: the cell. */
static void place_segments(const element_run *r, const segment_set *s, int half, uint32_t first,
                           double x[VISIBILITY_PACKET][3], opening_cell cells[VISIBILITY_PACKET],
                           float from[VISIBILITY_PACKET][3]) {
    const double *centre = visibility_centre(r->luminaire->sight->v);
    double place[4][VISIBILITY_PACKET];
    pair_sampler_packet(&s->places[half], first, place);
    for (size_t i = 0; i < VISIBILITY_PACKET; i++) {
        element_sampler_point(&s->sampler, (float)place[0][i], (float)place[1][i], from[i]);
        for (int d = 0; d < 3; d++) x[i][d] = (double)from[i][d] + centre[d];
        opening_place(&r->luminaire->source.opening, place[2][i], place[3][i], &cells[i]);
    }
}

static void cast_segments(const element_run *r, segment_set *s, size_t element, int half, uint32_t first) {
    const luminaire_run *run = r->luminaire;
    double x[VISIBILITY_PACKET][3];
    opening_cell cells[VISIBILITY_PACKET];
    float from[VISIBILITY_PACKET][3];
    size_t self[VISIBILITY_PACKET];
    ray_packet segments;
    place_segments(r, s, half, first, x, cells, from);
    for (size_t i = 0; i < VISIBILITY_PACKET; i++) {
        double there[3];
        float to[3];
        placed_source_outwards(&run->source, cells[i].at, there);
        for (int d = 0; d < 3; d++) there[d] += run->moved[d];
        luminaire_sight_recentre(run->sight, there, to);
        for (int d = 0; d < 3; d++) {
            segments.origin[d][i] = from[i][d];
            segments.direction[d][i] = to[d] - from[i][d];
        }
        self[i] = element;
    }
    luminaire_sight_passed(run->sight, &segments, VISIBILITY_PACKET, self,
                           &s->passed[(size_t)half * s->n / 2 + first]);
}

/* True where all segments pass the same. */
static bool all_pass(const segment_set *s, double *share) {
    *share = s->passed[0];
    for (size_t k = 1; k < s->n; k++)
        if (s->passed[k] < *share || s->passed[k] > *share) return false;
    return true;
}

/* Sums over segments: of I cos V / d^2, of I cos / d^2, of V, and the number of them; the shares V that
 * matter are from least to most. */
typedef struct segment_sums {
    double seen, open, passed, count, least, most;
} segment_sums;

static void weigh_segments(const element_run *r, const segment_set *s, size_t element, int half,
                           segment_sums *sums) {
    const placed_source *source = &r->luminaire->source;
    const float *n = r->m->normal[element];
    const double normal[3] = {(double)n[0], (double)n[1], (double)n[2]};
    double own_normal[3];
    placed_source_turn(source, normal, own_normal);
    for (size_t k = 0; k < s->n / 2; k += VISIBILITY_PACKET) {
        double x[VISIBILITY_PACKET][3];
        opening_cell cells[VISIBILITY_PACKET];
        float from[VISIBILITY_PACKET][3];
        place_segments(r, s, half, (uint32_t)k, x, cells, from);
        for (size_t i = 0; i < VISIBILITY_PACKET; i++) {
            const double passed = s->passed[(size_t)half * s->n / 2 + k + i];
            double own[3], towards[3];
            placed_source_inwards(source, x[i], own);
            const double across = placed_source_normal(source, &cells[i], own, towards),
                         light = across * fmax(0, dot3(towards, own_normal));
            sums->seen += light * passed;
            sums->open += light;
            sums->passed += passed;
            sums->count += 1;
            if (!(light > 0)) continue;
            sums->least = fmin(sums->least, passed);
            sums->most = fmax(sums->most, passed);
        }
    }
}

/* Weighted by light; where no segment carries any, as beside a narrow beam, they count alike. */
static double share_of(const segment_sums *s) {
    return s->open > 0 ? s->seen / s->open : s->passed / s->count;
}

/* H = open (sum f V / sum f) with f = I cos / d^2, and its squared error ((H_1 - H_2) / 2)^2. stream: apart
 * for each half and each number of segments. */
static void light_seen(const element_run *r, size_t element, size_t segments, uint64_t stream) {
    segment_set s;
    double share;
    s.n = segments;
    element_sampler_init(&s.sampler, r->m, r->luminaire->sight->v, element, r->options->seed);
    for (int half = 0; half < 2; half++) {
        pair_sampler_init(&s.places[half], r->options->seed + stream + (uint64_t)half, element,
                          r->luminaire->luminaire);
        for (uint32_t k = 0; k < s.n / 2; k += VISIBILITY_PACKET) cast_segments(r, &s, element, half, k);
    }
    r->off[element] = 0;
    if (all_pass(&s, &share)) { /* as nearly everywhere: the weights do not matter */
        r->H[element] = (float)(r->open[element] * share);
        r->found[element] = share > 0 ? CLEAR : DARK;
        return;
    }
    segment_sums half[2] = {{.least = INFINITY, .most = -INFINITY}, {.least = INFINITY, .most = -INFINITY}};
    for (int h = 0; h < 2; h++) weigh_segments(r, &s, element, h, &half[h]);
    const segment_sums both = {.seen = half[0].seen + half[1].seen,
                               .open = half[0].open + half[1].open,
                               .passed = half[0].passed + half[1].passed,
                               .count = half[0].count + half[1].count};
    const double least = fmin(half[0].least, half[1].least), most = fmax(half[0].most, half[1].most),
                 error = r->open[element] * (share_of(&half[0]) - share_of(&half[1])) / 2;
    r->H[element] = (float)(r->open[element] * share_of(&both));
    r->off[element] = (float)(error * error);
    r->found[element] = most - least > same_share ? PARTLY : most > 0 ? CLEAR : DARK;
}

/* All light of an element, and the findings of few segments. */
static void light_first(const element_run *r, size_t element, kept_cells *kept) {
    const bool lit = !mesh_is_buried(r->m, element);
    r->open[element] = lit ? element_light(r->m, element, &r->luminaire->source, kept) : 0;
    r->H[element] = (float)r->open[element];
    r->off[element] = 0;
    r->found[element] = UNLIT;
    if (r->open[element] > 0 && r->luminaire->sight->v != NULL) light_seen(r, element, r->segments, 0);
}

static size_t fewest(size_t a, size_t b) {
    return a < b ? a : b;
}

/* Elements that are partly hidden, and those that meet both, one that is hidden and one that is not: few
 * segments may have missed a corner of these. */
static void light_again(const element_run *r, size_t element) {
    bool again = false;
    for (size_t c = 0; c < mesh_corners(r->m, element); c++)
        again = again || r->corners[r->m->elements[element][c]] == PARTLY;
    if (!again || r->found[element] == UNLIT) return;
    if (r->found[element] != PARTLY) light_seen(r, element, fewest(r->more, BESIDE), 4);
    if (r->found[element] == PARTLY) light_seen(r, element, r->more, 2);
}

static void light_some_first(const void *job, size_t first, size_t last) {
    kept_cells kept;
    kept.of = NULL;
    for (size_t i = first; i < last; i++) light_first(job, i, &kept);
}

static void light_some_again(const void *job, size_t first, size_t last) {
    for (size_t i = first; i < last; i++) light_again(job, i);
}

/* All elements once; before: the share of the work of the luminaires before it. */
static lam_status light_all(const element_run *r, reported_pieces *light, double before, double part,
                            lam_error *error) {
    const reported_loop loop = {.progress = r->options->progress,
                                .stage = r->options->stage,
                                .before = before / (double)r->n_rows,
                                .part = part / (double)r->n_rows};
    return parallel_reported(&loop, r->m->n, ELEMENTS_AT_ONCE, light, r, error);
}

static void mark_corners(const element_run *r) {
    memset(r->corners, 0, r->m->n_vertices);
    for (size_t i = 0; i < r->m->n; i++)
        for (size_t c = 0; c < mesh_corners(r->m, i); c++) r->corners[r->m->elements[i][c]] |= r->found[i];
}

/* The errors of groups: elements_off = sum A v / sum A, means_off = sum A^2 v / (sum A)^2, as elements have
 * samples of their own. */
static void add_errors(const element_run *r, float *elements_off, float *means_off, double *sums) {
    const mesh *m = r->m;
    double *area = sums, *linear = sums + m->n_groups, *square = sums + 2 * m->n_groups;
    memset(sums, 0, 3 * m->n_groups * sizeof *sums);
    for (size_t i = 0; i < m->n; i++) {
        const double A = m->area[i], v = (double)r->off[i];
        if (mesh_is_buried(m, i)) continue;
        area[m->group[i]] += A;
        linear[m->group[i]] += A * v;
        square[m->group[i]] += A * A * v;
    }
    for (size_t g = 0; g < m->n_groups; g++) {
        elements_off[g] = area[g] > 0 ? (float)(linear[g] / area[g]) : 0;
        means_off[g] = area[g] > 0 ? (float)(square[g] / (area[g] * area[g])) : 0;
    }
}

static lam_status report_luminaire(const mesh *m, const luminaire_run *run, direct_report *out,
                                   lam_error *error) {
    const ignored_groups *ignored = run->ignored;
    out->luminaire = run->luminaire;
    out->ignored = memory_allocate(ignored->n, sizeof *out->ignored, "ignored groups", error);
    if (out->ignored == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < ignored->n; k++) out->ignored[k] = ignored->groups[k];
    out->n_ignored = ignored->n;
    out->near_share = luminaire_sight_near(run->sight, &run->source, run->moved, DIRECT_NEAR);
    for (size_t i = 0; i < m->n && !run->source.opening.flat; i++) {
        double middle[3], own[3];
        mesh_centroid(m, i, middle);
        placed_source_inwards(&run->source, middle, own);
        out->n_inside += !(opening_distance(&run->source.opening, own) > 0);
    }
    return LAM_OK;
}

/* The parts of the light of all luminaires. */
typedef struct elements_job {
    element_run elements;
    double *sums; /* [3][n_groups] */
    direct_light *out;
} elements_job;

/* sum A H over the lumens. */
static double lit_share(const element_run *r) {
    const placed_source *source = &r->luminaire->source;
    const double lumens = source->factor * luminaire_lumens(source->photometry);
    double sum = 0;
    for (size_t i = 0; i < r->m->n; i++) sum += r->m->area[i] * (double)r->H[i];
    return lumens > 0 ? sum / lumens : 1;
}

static lam_status light_luminaire(void *context, const luminaire_run *run, lam_error *error) {
    lam_status status = LAM_OK;
    elements_job *job = context;
    element_run *r = &job->elements;
    const size_t row = run->row;
    const double before = (double)run->step;
    r->luminaire = run;
    r->H = job->out->H + row * r->m->n;
    TRY(light_all(r, light_some_first, before, .7, error));
    mark_corners(r);
    TRY(light_all(r, light_some_again, before + .7, .3, error));
    add_errors(r, job->out->elements_off + row * r->m->n_groups, job->out->means_off + row * r->m->n_groups,
               job->sums);
    TRY(report_luminaire(r->m, run, &job->out->reports[row], error));
    job->out->reports[row].lit_share = lit_share(r);
done:
    return status;
}

static size_t segments_of(size_t asked, size_t preset) {
    const size_t wanted = asked > 0 ? asked : preset;
    size_t n = 2 * VISIBILITY_PACKET;
    while (n < wanted && n < SEGMENTS_MOST) n *= 2;
    return n;
}

static lam_status make_light(const mesh *m, const placed_luminaires *p, const direct_options *o,
                             elements_job *job, lam_error *error) {
    lam_status status = LAM_OK;
    direct_light *out = job->out;
    element_run *r = &job->elements;
    size_t size, figures;
    out->n_luminaires = o->wanted != NULL ? o->n_wanted : p->n;
    out->n = m->n;
    out->n_groups = m->n_groups;
    if (!size_multiply(out->n_luminaires, m->n, &size) ||
        !size_multiply(out->n_luminaires, m->n_groups, &figures))
        FAIL(error, LAM_ERR_MEMORY, "light of luminaires: too many elements");
    out->H = memory_allocate(size, sizeof *out->H, "light of luminaires", error);
    out->elements_off = memory_allocate(figures, sizeof *out->elements_off, "light of luminaires", error);
    out->means_off = memory_allocate(figures, sizeof *out->means_off, "light of luminaires", error);
    out->reports = memory_allocate(out->n_luminaires, sizeof *out->reports, "light of luminaires", error);
    r->open = memory_allocate(m->n, sizeof *r->open, "light of luminaires", error);
    r->off = memory_allocate(m->n, sizeof *r->off, "light of luminaires", error);
    r->found = memory_allocate(m->n, sizeof *r->found, "light of luminaires", error);
    r->corners = memory_allocate(m->n_vertices, sizeof *r->corners, "light of luminaires", error);
    job->sums = memory_allocate(3 * m->n_groups, sizeof *job->sums, "light of luminaires", error);
    if (out->H == NULL || out->elements_off == NULL || out->means_off == NULL || out->reports == NULL ||
        r->open == NULL || r->off == NULL || r->found == NULL || r->corners == NULL || job->sums == NULL)
        TRY(LAM_ERR_MEMORY);
    r->n_rows = out->n_luminaires;
    TRY(luminaire_runs(m, p, o->n_wanted, o->wanted, light_luminaire, job, error));
done:
    return status;
}

lam_status direct_light_make(const mesh *m, const placed_luminaires *p, const direct_options *o,
                             direct_light *out, lam_error *error) {
    lam_status status = LAM_OK;
    direct_light made = {.n = 0};
    elements_job job = {.elements = {.m = m,
                                     .options = o,
                                     .segments = segments_of(o->segments, SEGMENTS),
                                     .more = segments_of(o->more_segments, MORE_SEGMENTS)},
                        .out = &made};
    TRY(make_light(m, p, o, &job, error));
    *out = made;
    made = (direct_light){.n = 0};
done:
    free(job.elements.open);
    free(job.elements.off);
    free(job.elements.found);
    free(job.elements.corners);
    free(job.sums);
    direct_light_free(&made);
    return status;
}

void direct_light_free(direct_light *l) {
    for (size_t k = 0; k < l->n_luminaires && l->reports != NULL; k++) free(l->reports[k].ignored);
    free(l->H);
    free(l->elements_off);
    free(l->means_off);
    free(l->reports);
    *l = (direct_light){.n = 0};
}

/* Adds text to a line that it is cut to fit. */
static void add_text(char line[DIRECT_LINE], const char *text) {
    const size_t length = strlen(line);
    snprintf(line + length, DIRECT_LINE - length, "%s", text);
}

void direct_report_line(const mesh *m, const placed_luminaires *p, const direct_report *r,
                        char line[DIRECT_LINE]) {
    const double half = .5, unlit = .01;
    char figure[128];
    line[0] = '\0';
    if (r->n_ignored > 0) {
        add_text(line, "not hidden by ");
        for (size_t k = 0; k < r->n_ignored; k++) {
            if (k > 0) add_text(line, ", ");
            add_text(line, m->group_names[r->ignored[k]]);
        }
    }
    if (r->near_share > half) {
        snprintf(figure, sizeof figure, "%s%.0f %% of its light ends within %g m of it", line[0] ? "; " : "",
                 100 * r->near_share, DIRECT_NEAR);
        add_text(line, figure);
    }
    if (r->lit_share < unlit) {
        snprintf(figure, sizeof figure, "%sless than %g %% of its light reaches a face", line[0] ? "; " : "",
                 100 * unlit);
        add_text(line, figure);
    }
    if (r->n_inside > 0) {
        snprintf(figure, sizeof figure, "%s%zu element%s inside its opening", line[0] ? "; " : "",
                 r->n_inside, r->n_inside == 1 ? " lies" : "s lie");
        add_text(line, figure);
    }
    if (line[0] == '\0') return;
    char head[PLACED_NAME + 16];
    snprintf(head, sizeof head, "luminaire %s: ", p->luminaires[r->luminaire].name);
    const size_t length = strlen(head), kept = strlen(line);
    const size_t room = DIRECT_LINE - 1 - length;
    memmove(line + length, line, kept < room ? kept : room);
    memcpy(line, head, length);
    line[length + (kept < room ? kept : room)] = '\0';
}
