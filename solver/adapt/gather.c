#include "solver/adapt/gather.h"

#include "solver/adapt/lamp_groups.h"
#include "solver/base/cosine.h"
#include "solver/base/random.h"
#include "solver/formfactor/visibility/pane_path.h"
#include "solver/formfactor/visibility/sample.h"
#include "solver/scene/element_face.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct gather {
    const mesh *m;
    size_t n_lights;
    const float *B;
    const gather_sky *sky;       /* NULL: none */
    const gather_direct *direct; /* NULL: none */
    visibility *v;
    lamp_groups lamps;
};

/* The same for all points of a call. */
typedef struct gather_samples {
    float direction[GATHER_HALVES][GATHER_RAYS][3];
    uint32_t lamp[GATHER_HALVES][GATHER_LAMP_SAMPLES];
    bool unseen[GATHER_HALVES][GATHER_LAMP_SAMPLES];     /* the lamp lies in the plane of the element */
    double place[GATHER_HALVES][GATHER_LAMP_SAMPLES][3]; /* recentred */
    lamp_shares shares;
} gather_samples;

size_t gather_values(const gather *g) {
    return g->n_lights * g->m->n_channels;
}

void gather_free(gather *g) {
    if (g == NULL) return;
    visibility_destroy(g->v);
    lamp_groups_free(&g->lamps);
    free(g);
}

lam_status gather_create(const mesh *m, size_t n_lights, const float *B, const float *lamps,
                         const gather_sky *sky, const gather_direct *direct, gather **out, lam_error *error) {
    lam_status status = LAM_OK;
    gather *g = NULL;
    if (n_lights * m->n_channels > GATHER_VALUES_MOST)
        FAIL(error, LAM_ERR_ARGUMENT, "%zu lights of %zu channels, at most %d values", n_lights,
             m->n_channels, (int)GATHER_VALUES_MOST);
    g = memory_allocate(1, sizeof *g, "light at points", error);
    if (g == NULL) TRY(LAM_ERR_MEMORY);
    *g = (gather){.m = m, .n_lights = n_lights, .B = B, .sky = sky, .direct = direct};
    TRY(visibility_create(m, &g->v, error));
    TRY(lamp_groups_make(m, g->v, lamps, &g->lamps, error));
    *out = g;
    g = NULL;
done:
    gather_free(g);
    return status;
}

/* Coordinate d < 4 of point k: the Kronecker sequence of the generalised golden ratio (Roberts 2018) in two
 * dimensions, moved by a shift; coordinates 2 and 3 are those of another shift. */
static double spread(const uint64_t shift[2], size_t k, int d) {
    static const uint32_t step[2] = {3242174889u, 2447445414u}; /* 2^32 / p, / p^2; p^3 = p + 1 */
    const uint32_t start = (uint32_t)(d % 2 == 0 ? shift[d / 2] : shift[d / 2] >> 32);
    return (double)(uint32_t)(start + (uint32_t)k * step[d % 2]) * 0x1p-32;
}

static void draw(const gather *g, uint32_t element, uint64_t key, size_t n_points, const double (*points)[3],
                 gather_samples *s) {
    element_frame frame;
    if (g->lamps.n > 0) lamp_groups_share(&g->lamps, element, key, n_points, points, &s->shares);
    element_frame_init(&frame, g->m, element);
    for (size_t h = 0; h < GATHER_HALVES; h++) {
        const uint64_t first = random_hash(key ^ random_hash(h + 1)), shift[2] = {first, random_hash(first)};
        for (size_t r = 0; r < GATHER_RAYS; r++)
            cosine_direction(frame.tangent, frame.bitangent, frame.normal, spread(shift, r, 0),
                             spread(shift, r, 1), s->direction[h][r]);
        for (size_t k = 0; k < GATHER_LAMP_SAMPLES && g->lamps.n > 0; k++) {
            const double turn = random_to_double(random_hash(shift[1]));
            const uint32_t lamp =
                lamp_groups_at(&g->lamps, &s->shares, ((double)k + turn) / GATHER_LAMP_SAMPLES);
            element_sampler sampler;
            float point[3];
            element_sampler_init(&sampler, g->m, g->v, lamp, 0);
            element_sampler_point(&sampler, (float)spread(shift, k, 2), (float)spread(shift, k, 3), point);
            s->lamp[h][k] = lamp;
            s->unseen[h][k] = lamp == element || elements_share_plane(g->m, element, lamp);
            for (int d = 0; d < 3; d++) s->place[h][k][d] = (double)point[d];
        }
    }
}

/* T E_j K / (R K + S q_j), to the first light, with K = cos cos' / (pi r^2) the density of rays at the place,
 * q_j that of lamp samples, and T what panes between them pass. */
static void add_lamp(const gather *g, const gather_samples *s, uint32_t j, double K, double T, double *H) {
    const double q = lamp_groups_density(&g->lamps, &s->shares, j);
    const double weight = T * K / (GATHER_RAYS * K + GATHER_LAMP_SAMPLES * q);
    for (size_t c = 0; c < g->m->n_channels; c++) H[c] += (double)g->lamps.E[c * g->m->n + j] * weight;
}

/* The light that a ray brings from the element that it hits, through panes that pass T. */
static void add_hit(const gather *g, const gather_samples *s, const float direction[3], uint32_t j,
                    double distance, double cosine, double T, double *H) {
    const mesh *m = g->m;
    const float *normal = m->normal[j];
    const double facing =
        -(double)(direction[0] * normal[0] + direction[1] * normal[1] + direction[2] * normal[2]);
    const bool lamp = g->lamps.n > 0 && lamp_groups_brightness(&g->lamps, j) > 0;
    for (size_t l = 0; l < g->n_lights; l++)
        for (size_t c = 0; c < m->n_channels; c++) {
            const size_t row = l * m->n_channels + c;
            double B = (double)g->B[row * m->n + j];
            if (l == 0 && lamp) B -= (double)g->lamps.E[c * m->n + j];
            H[row] += T * B / GATHER_RAYS;
        }
    if (lamp) add_lamp(g, s, j, cosine * fmax(facing, 0) / (M_PI * fmax(distance * distance, 1e-300)), T, H);
}

/* The light that the rays of a packet bring from where they leave the scene: pi times the radiance there. */
static void add_sky(const gather *g, const ray_packet *rays, const hit_packet *hits,
                    const double passed[VISIBILITY_PACKET], double *H) {
    uint32_t tile[SKY_PACKET];
    const size_t channels = g->m->n_channels, tiles = g->sky->tiling->n_tiles;
    sky_tiling_find(g->sky->tiling, rays->direction, tile);
    for (size_t i = 0; i < VISIBILITY_PACKET; i++)
        for (size_t row = 0; hits->element[i] == VISIBILITY_NOTHING && row < g->n_lights * channels; row++)
            H[row] += passed[i] * M_PI * g->sky->L[row / channels * (tiles + 1) + tile[i]] / GATHER_RAYS;
}

/* Casts the packet of rays of a half that begins with the first. */
static void cast(const gather *g, const gather_samples *s, size_t half, size_t first, uint32_t element,
                 const float origin[3], ray_packet *rays, hit_packet *hits) {
    uint32_t self[VISIBILITY_PACKET];
    for (size_t i = 0; i < VISIBILITY_PACKET; i++) {
        self[i] = element;
        for (int d = 0; d < 3; d++) {
            rays->origin[d][i] = origin[d];
            rays->direction[d][i] = s->direction[half][first + i][d];
        }
    }
    visibility_cast(g->v, rays, VISIBILITY_PACKET, self, 0, hits);
}

/* The light of the fronts that rays from a point meet: that of panes, or of all others. */
static void add_hits(const gather *g, const gather_samples *s, const float *normal, const float origin[3],
                     const ray_packet *rays, const hit_packet *hits, const double passed[VISIBILITY_PACKET],
                     bool panes, double *H) {
    for (size_t i = 0; i < VISIBILITY_PACKET; i++) {
        const float to[3] = {rays->direction[0][i], rays->direction[1][i], rays->direction[2][i]};
        double before = 0;
        if (hits->element[i] == VISIBILITY_NOTHING || hits->back[i]) continue;
        if (mesh_is_pane(g->m, hits->element[i]) != panes) continue;
        for (int d = 0; d < 3; d++) before += (double)(rays->origin[d][i] - origin[d]) * (double)to[d];
        add_hit(g, s, to, hits->element[i], before + (double)hits->distance[i],
                (double)(to[0] * normal[0] + to[1] * normal[1] + to[2] * normal[2]), passed[i], H);
    }
}

static void add_rays(const gather *g, const gather_samples *s, size_t half, uint32_t element,
                     const float origin[3], double *H) {
    const float *normal = g->m->normal[element];
    for (size_t first = 0; first < GATHER_RAYS; first += VISIBILITY_PACKET) {
        ray_packet rays;
        hit_packet hits;
        double passed[VISIBILITY_PACKET] = {1, 1, 1, 1, 1, 1, 1, 1};
        cast(g, s, half, first, element, origin, &rays, &hits);
        if (g->m->glass != NULL) {
            add_hits(g, s, normal, origin, &rays, &hits, passed, true, H);
            pane_path_follow(g->v, g->m, &rays, VISIBILITY_PACKET, &hits, passed, NULL);
        }
        if (g->sky != NULL) add_sky(g, &rays, &hits, passed, H);
        add_hits(g, s, normal, origin, &rays, &hits, passed, false, H);
    }
}

/* cos cos' / (pi r^2) of a segment; 0 where either end turns away. */
static double kernel(const mesh *m, uint32_t from, uint32_t to, const double segment[3]) {
    double r2 = 0, leaves = 0, arrives = 0;
    for (int d = 0; d < 3; d++) {
        r2 += segment[d] * segment[d];
        leaves += segment[d] * (double)m->normal[from][d];
        arrives -= segment[d] * (double)m->normal[to][d];
    }
    return leaves > 0 && arrives > 0 ? leaves * arrives / (M_PI * r2 * r2) : 0;
}

/* Adds the lamp samples of a packet's size that begin with the first. */
static void add_lamps(const gather *g, const gather_samples *s, size_t half, size_t first, uint32_t element,
                      const float origin[3], double *H) {
    const uint32_t *lamp = s->lamp[half] + first;
    const bool *unseen = s->unseen[half] + first;
    const double(*place)[3] = (const double(*)[3])s->place[half] + first;
    ray_packet segments = {.origin = {{0}}};
    double K[VISIBILITY_PACKET];
    uint32_t from[VISIBILITY_PACKET] = {0}, to[VISIBILITY_PACKET] = {0};
    size_t n = 0;
    for (size_t k = 0; k < VISIBILITY_PACKET; k++) {
        double segment[3];
        for (int d = 0; d < 3; d++) segment[d] = place[k][d] - (double)origin[d];
        K[n] = !unseen[k] ? kernel(g->m, element, lamp[k], segment) : 0;
        if (!(K[n] > 0)) continue;
        for (int d = 0; d < 3; d++) {
            segments.origin[d][n] = origin[d];
            segments.direction[d][n] = (float)segment[d];
        }
        from[n] = element;
        to[n++] = lamp[k];
    }
    if (n == 0) return;
    const unsigned blocked = visibility_blocked(g->v, &segments, n, from, to);
    double passed[VISIBILITY_PACKET];
    pane_path_between(g->v, g->m, &segments, n, from, to, blocked, passed);
    for (size_t i = 0; i < n; i++)
        if (passed[i] > 0) add_lamp(g, s, to[i], K[i], passed[i], H);
}

void gather_at(const gather *g, uint32_t element, uint64_t key, size_t n_points, const double (*points)[3],
               double *H) {
    const size_t values = gather_values(g);
    gather_samples s;
    draw(g, element, key, n_points, points, &s);
    memset(H, 0, n_points * GATHER_HALVES * values * sizeof *H);
    for (size_t p = 0; p < n_points; p++) {
        float origin[3];
        visibility_recentre(g->v, points[p], origin);
        for (size_t h = 0; h < GATHER_HALVES; h++) {
            double *of = H + (p * GATHER_HALVES + h) * values;
            add_rays(g, &s, h, element, origin, of);
            for (size_t k = 0; g->lamps.n > 0 && k < GATHER_LAMP_SAMPLES; k += VISIBILITY_PACKET)
                add_lamps(g, &s, h, k, element, origin, of);
        }
    }
    if (g->direct == NULL) return;
    const float *n = g->m->normal[element];
    const double normal[3] = {(double)n[0], (double)n[1], (double)n[2]};
    g->direct->add(g->direct->context, normal, key, n_points, points, values, H);
}

void gather_hits(const gather *g, uint32_t element, uint64_t key, size_t n_points, const double (*points)[3],
                 uint32_t *hit) {
    gather_samples s;
    draw(g, element, key, n_points, points, &s);
    for (size_t p = 0; p < n_points; p++) {
        float origin[3];
        visibility_recentre(g->v, points[p], origin);
        for (size_t h = 0; h < GATHER_HALVES; h++)
            for (size_t first = 0; first < GATHER_RAYS; first += VISIBILITY_PACKET) {
                ray_packet rays;
                hit_packet hits;
                cast(g, &s, h, first, element, origin, &rays, &hits);
                for (size_t i = 0; i < VISIBILITY_PACKET; i++)
                    *hit++ = hits.back[i] ? VISIBILITY_NOTHING : hits.element[i];
            }
    }
}

void gather_place(const gather *g, uint32_t element, size_t n, const float (*uw)[2], double (*points)[3]) {
    const double *centre = visibility_centre(g->v);
    element_sampler sampler;
    element_sampler_init(&sampler, g->m, g->v, element, 0);
    for (size_t k = 0; k < n; k++) {
        float point[3];
        element_sampler_point(&sampler, uw[k][0], uw[k][1], point);
        for (int d = 0; d < 3; d++) points[k][d] = (double)point[d] + centre[d];
    }
}

void gather_quarters(const gather *g, uint32_t element, uint64_t key, double points[GATHER_QUARTERS][3]) {
    float uw[GATHER_QUARTERS][2];
    uint64_t random = key;
    for (size_t k = 0; k < GATHER_QUARTERS; k++) {
        uw[k][0] = (float)((double)(k % 2) + random_unit(&random)) / 2;
        uw[k][1] = (float)((double)(k / 2) + random_unit(&random)) / 2;
        for (int d = 0; d < 2; d++) uw[k][d] = fminf(uw[k][d], 1 - 0x1p-24f);
    }
    gather_place(g, element, GATHER_QUARTERS, (const float(*)[2])uw, points);
}
