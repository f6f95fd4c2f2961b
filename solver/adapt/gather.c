#include "solver/adapt/gather.h"

#include "solver/base/cosine.h"
#include "solver/base/random.h"
#include "solver/formfactor/visibility/sample.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct gather {
    const mesh *m;
    size_t n_lights;
    const float *B, *lamps;
    const gather_sky *sky; /* NULL: none */
    visibility *v;
    size_t lamp_samples, n_lamps;
    uint32_t *lamp; /* [n_lamps], elements that emit */
    double *before; /* [n_lamps + 1]: power of those before, all channels */
};

/* The same for all points of a call. */
typedef struct gather_samples {
    float direction[GATHER_HALVES][GATHER_RAYS][3];
    uint32_t lamp[GATHER_HALVES][GATHER_LAMP_SAMPLES_MOST];
    double place[GATHER_HALVES][GATHER_LAMP_SAMPLES_MOST][3]; /* recentred */
} gather_samples;

size_t gather_values(const gather *g) {
    return g->n_lights * g->m->n_channels;
}

void gather_free(gather *g) {
    if (g == NULL) return;
    visibility_destroy(g->v);
    free(g->lamp);
    free(g->before);
    free(g);
}

/* Emission of all channels. */
static double brightness(const gather *g, size_t i) {
    double sum = 0;
    for (size_t c = 0; c < g->m->n_channels; c++) sum += (double)g->lamps[c * g->m->n + i];
    return sum;
}

static lam_status find_lamps(gather *g, lam_error *error) {
    const mesh *m = g->m;
    size_t n = 0;
    for (size_t i = 0; g->lamps != NULL && i < m->n; i++) n += brightness(g, i) > 0;
    g->lamp = memory_allocate(n, sizeof *g->lamp, "lamps", error);
    g->before = memory_allocate(n + 1, sizeof *g->before, "lamps", error);
    if (g->lamp == NULL || g->before == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; n > 0 && i < m->n; i++) {
        if (!(brightness(g, i) > 0)) continue;
        g->before[g->n_lamps + 1] = g->before[g->n_lamps] + m->area[i] * brightness(g, i);
        g->lamp[g->n_lamps++] = (uint32_t)i;
    }
    return LAM_OK;
}

lam_status gather_create(const mesh *m, size_t n_lights, const float *B, const float *lamps,
                         size_t lamp_samples, const gather_sky *sky, gather **out, lam_error *error) {
    lam_status status = LAM_OK;
    gather *g = NULL;
    if (n_lights * m->n_channels > GATHER_VALUES_MOST)
        FAIL(error, LAM_ERR_ARGUMENT, "%zu lights of %zu channels, at most %d values", n_lights,
             m->n_channels, (int)GATHER_VALUES_MOST);
    g = memory_allocate(1, sizeof *g, "light at points", error);
    if (g == NULL) TRY(LAM_ERR_MEMORY);
    *g = (gather){
        .m = m, .n_lights = n_lights, .B = B, .lamps = lamps, .lamp_samples = lamp_samples, .sky = sky};
    TRY(visibility_create(m, &g->v, error));
    TRY(find_lamps(g, error));
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

static size_t lamp_at(const gather *g, double power) {
    size_t low = 0, high = g->n_lamps;
    while (high - low > 1) {
        const size_t middle = (low + high) / 2;
        if (g->before[middle] <= power)
            low = middle;
        else
            high = middle;
    }
    return low;
}

static void draw(const gather *g, uint32_t element, uint64_t key, gather_samples *s) {
    element_frame frame;
    element_frame_init(&frame, g->m, element);
    for (size_t h = 0; h < GATHER_HALVES; h++) {
        const uint64_t first = random_hash(key ^ random_hash(h + 1)), shift[2] = {first, random_hash(first)};
        for (size_t r = 0; r < GATHER_RAYS; r++)
            cosine_direction(frame.tangent, frame.bitangent, frame.normal, spread(shift, r, 0),
                             spread(shift, r, 1), s->direction[h][r]);
        for (size_t k = 0; k < g->lamp_samples && g->n_lamps > 0; k++) {
            const double turn = random_to_double(random_hash(shift[1]));
            const size_t lamp =
                lamp_at(g, ((double)k + turn) / (double)g->lamp_samples * g->before[g->n_lamps]);
            element_sampler sampler;
            float point[3];
            element_sampler_init(&sampler, g->m, g->v, g->lamp[lamp], 0);
            element_sampler_point(&sampler, (float)spread(shift, k, 2), (float)spread(shift, k, 3), point);
            s->lamp[h][k] = g->lamp[lamp];
            for (int d = 0; d < 3; d++) s->place[h][k][d] = (double)point[d];
        }
    }
}

/* E_j K / (R K + S q_j), to the first light, with K = cos cos' / (pi r^2) the density of rays at the place
 * and q_j = E_j / power that of lamp samples. */
static void add_lamp(const gather *g, uint32_t j, double K, double *H) {
    const double power = g->n_lamps > 0 ? g->before[g->n_lamps] : 0;
    const double q = power > 0 ? brightness(g, j) / power : 0;
    const double weight = K / (GATHER_RAYS * K + (double)g->lamp_samples * q);
    for (size_t c = 0; c < g->m->n_channels; c++) H[c] += (double)g->lamps[c * g->m->n + j] * weight;
}

/* The light that a ray brings from the element that it hits. */
static void add_hit(const gather *g, const float direction[3], uint32_t j, double distance, double cosine,
                    double *H) {
    const mesh *m = g->m;
    const float *normal = m->normal[j];
    const double facing =
        -(double)(direction[0] * normal[0] + direction[1] * normal[1] + direction[2] * normal[2]);
    const bool lamp = g->n_lamps > 0 && brightness(g, j) > 0;
    for (size_t l = 0; l < g->n_lights; l++)
        for (size_t c = 0; c < m->n_channels; c++) {
            const size_t row = l * m->n_channels + c;
            double B = (double)g->B[row * m->n + j];
            if (l == 0 && lamp) B -= (double)g->lamps[c * m->n + j];
            H[row] += B / GATHER_RAYS;
        }
    if (lamp) add_lamp(g, j, cosine * fmax(facing, 0) / (M_PI * fmax(distance * distance, 1e-300)), H);
}

/* The light that the rays of a packet bring from where they leave the scene: pi times the radiance there. */
static void add_sky(const gather *g, const ray_packet *rays, const hit_packet *hits, double *H) {
    uint32_t tile[SKY_PACKET];
    const size_t channels = g->m->n_channels, tiles = g->sky->tiling->n_tiles;
    sky_tiling_find(g->sky->tiling, rays->direction, tile);
    for (size_t i = 0; i < VISIBILITY_PACKET; i++)
        for (size_t row = 0; hits->element[i] == VISIBILITY_NOTHING && row < g->n_lights * channels; row++)
            H[row] += M_PI * g->sky->L[row / channels * (tiles + 1) + tile[i]] / GATHER_RAYS;
}

static void add_rays(const gather *g, uint32_t element, const float origin[3], float (*direction)[3],
                     double *H) {
    const float *normal = g->m->normal[element];
    for (size_t first = 0; first < GATHER_RAYS; first += VISIBILITY_PACKET) {
        ray_packet rays;
        hit_packet hits;
        uint32_t self[VISIBILITY_PACKET];
        for (size_t i = 0; i < VISIBILITY_PACKET; i++) {
            self[i] = element;
            for (int d = 0; d < 3; d++) {
                rays.origin[d][i] = origin[d];
                rays.direction[d][i] = direction[first + i][d];
            }
        }
        visibility_cast(g->v, &rays, VISIBILITY_PACKET, self, 0, &hits);
        if (g->sky != NULL) add_sky(g, &rays, &hits, H);
        for (size_t i = 0; i < VISIBILITY_PACKET; i++) {
            const float *to = direction[first + i];
            if (hits.element[i] == VISIBILITY_NOTHING || hits.back[i]) continue;
            add_hit(g, to, hits.element[i], (double)hits.distance[i],
                    (double)(to[0] * normal[0] + to[1] * normal[1] + to[2] * normal[2]), H);
        }
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
static void add_lamps(const gather *g, uint32_t element, const float origin[3], const uint32_t *lamp,
                      double (*place)[3], double *H) {
    ray_packet segments = {.origin = {{0}}};
    double K[VISIBILITY_PACKET];
    uint32_t from[VISIBILITY_PACKET] = {0}, to[VISIBILITY_PACKET] = {0};
    size_t n = 0;
    for (size_t k = 0; k < VISIBILITY_PACKET; k++) {
        double segment[3];
        for (int d = 0; d < 3; d++) segment[d] = place[k][d] - (double)origin[d];
        K[n] = lamp[k] != element ? kernel(g->m, element, lamp[k], segment) : 0;
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
    for (size_t i = 0; i < n; i++)
        if (!(blocked >> i & 1)) add_lamp(g, to[i], K[i], H);
}

void gather_at(const gather *g, uint32_t element, uint64_t key, size_t n_points, const double (*points)[3],
               double *H) {
    const size_t values = gather_values(g);
    gather_samples s;
    draw(g, element, key, &s);
    memset(H, 0, n_points * GATHER_HALVES * values * sizeof *H);
    for (size_t p = 0; p < n_points; p++) {
        float origin[3];
        visibility_recentre(g->v, points[p], origin);
        for (size_t h = 0; h < GATHER_HALVES; h++) {
            double *of = H + (p * GATHER_HALVES + h) * values;
            add_rays(g, element, origin, s.direction[h], of);
            for (size_t k = 0; g->n_lamps > 0 && k < g->lamp_samples; k += VISIBILITY_PACKET)
                add_lamps(g, element, origin, s.lamp[h] + k, s.place[h] + k, of);
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
