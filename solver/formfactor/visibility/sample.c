#include "solver/formfactor/visibility/sample.h"

#include "solver/base/random.h"
#include "solver/formfactor/visibility/sobol.h"
#include "solver/scene/plane.h"

#include <math.h>

static void set_piece(element_sampler *s, int piece, const double *a, const double *b, const double *c,
                      const visibility *v) {
    visibility_recentre(v, a, s->corner[piece]);
    for (int d = 0; d < 3; d++) {
        s->edge[piece][0][d] = (float)(b[d] - a[d]);
        s->edge[piece][1][d] = (float)(c[d] - a[d]);
    }
}

void element_frame_init(element_frame *f, const mesh *m, size_t element) {
    const double *a = m->vertices[m->elements[element][0]], *b = m->vertices[m->elements[element][1]];
    const float *normal = m->normal[element];
    double t[3], length = 0;
    for (int d = 0; d < 3; d++) length += (b[d] - a[d]) * (b[d] - a[d]);
    length = sqrt(length);
    for (int d = 0; d < 3; d++) t[d] = (b[d] - a[d]) / length;
    const double n[3] = {normal[0], normal[1], normal[2]};
    for (int d = 0; d < 3; d++) {
        f->normal[d] = normal[d];
        f->tangent[d] = (float)t[d];
        f->bitangent[d] = (float)(n[(d + 1) % 3] * t[(d + 2) % 3] - n[(d + 2) % 3] * t[(d + 1) % 3]);
    }
}

/* The dimension of Sobol's sequence for a coordinate: the first two, which are more even in pairs than the
 * others, for the direction, coordinates 2 and 3. */
static inline int dimension_of(int coordinate) {
    return coordinate ^ 2;
}

/* low[k]: the shifted coordinate of k; middle[k]: that of 32 k, without a shift. */
static void set_tables(element_sampler *s, int d, uint32_t shift) {
    const uint32_t *v = sobol_direction[dimension_of(d)];
    s->low[d][0] = shift;
    s->middle[d][0] = 0;
    for (int bit = 0; bit < SAMPLE_TABLE_BITS; bit++)
        for (int k = 0; k < 1 << bit; k++) {
            s->low[d][(1 << bit) + k] = s->low[d][k] ^ v[bit];
            s->middle[d][(1 << bit) + k] = s->middle[d][k] ^ v[bit + SAMPLE_TABLE_BITS];
        }
}

void element_sampler_init(element_sampler *s, const mesh *m, const visibility *v, size_t element,
                          uint64_t seed) {
    const uint32_t *corner = m->elements[element];
    const double *a = m->vertices[corner[0]], *b = m->vertices[corner[1]], *c = m->vertices[corner[2]];
    s->parallelogram = false;
    s->first_share = 1;
    set_piece(s, 0, a, b, c, v);
    if (mesh_corners(m, element) == 4) {
        const double *e = m->vertices[corner[3]];
        double off = 0, size = 0;
        for (int d = 0; d < 3; d++) {
            off += fabs(a[d] - b[d] + c[d] - e[d]);
            size += fabs(c[d] - a[d]) + fabs(e[d] - b[d]);
        }
        s->parallelogram = off <= 1e-9 * size;
        if (s->parallelogram) {
            set_piece(s, 0, a, b, e, v);
        } else {
            const double first = triangle_area(a, b, c), second = triangle_area(a, c, e);
            s->first_share = (float)(first / (first + second));
            set_piece(s, 1, a, c, e, v);
        }
    }
    element_frame_init(&s->frame, m, element);
    uint64_t state = random_hash(seed) ^ random_hash((uint64_t)element + 1);
    for (int d = 0; d < 4; d++) {
        if (d % 2 == 0) state = random_hash(state);
        set_tables(s, d, (uint32_t)(d % 2 == 0 ? state : state >> 32));
    }
}

/* The part of a coordinate that the tables do not know. */
static inline uint32_t of_high_bits(int d, uint32_t index) {
    return sobol_coordinate(dimension_of(d), index >> 2 * SAMPLE_TABLE_BITS << 2 * SAMPLE_TABLE_BITS);
}

static inline uint32_t of_low_bits(const element_sampler *s, int d, uint32_t index) {
    return s->low[d][index % SAMPLE_TABLE] ^ s->middle[d][index / SAMPLE_TABLE % SAMPLE_TABLE];
}

/* The points of a packet, whose indices mostly have the same high bits. */
static void set_places(const element_sampler *s, const uint32_t index[VISIBILITY_PACKET],
                       uint32_t place[4][VISIBILITY_PACKET]) {
    uint32_t apart = 0;
    for (int i = 1; i < VISIBILITY_PACKET; i++) apart |= (index[i] ^ index[0]) >> 2 * SAMPLE_TABLE_BITS;
    for (int d = 0; d < 4; d++) {
        const uint32_t high = of_high_bits(d, index[0]);
        for (int i = 0; i < VISIBILITY_PACKET; i++) place[d][i] = of_low_bits(s, d, index[i]) ^ high;
        for (int i = 0; i < VISIBILITY_PACKET && apart != 0; i++)
            place[d][i] ^= high ^ of_high_bits(d, index[i]);
    }
}

/* A 32-bit fraction as a float in [0, 1). */
static inline float fraction(uint32_t x) {
    return (float)(int32_t)(x >> 8) * 0x1p-24f; /* signed: converted four at once */
}

/* a where the mask is all ones, b where it is 0. */
static inline float pick(uint32_t mask, float a, float b) {
    union {
        float value;
        uint32_t bits;
    } one = {.value = a}, two = {.value = b};
    one.bits = (one.bits & mask) | (two.bits & ~mask);
    return one.value;
}

/* The concentric map of the square to the disc (Shirley and Chiu 1997), which is continuous and preserves
 * area and so low discrepancy. x, y in [-1, 1]; the sine and cosine of |angle| <= pi/4 are Taylor polynomials
 * to 4e-8. */
static inline void square_to_disc(float x, float y, float *dx, float *dy) {
    /* Masks in place of branches let the compiler map eight points at once. */
    const uint32_t wide = -(uint32_t)(fabsf(x) > fabsf(y));
    const float r = pick(wide, x, y), other = pick(wide, y, x);
    const float ratio = other / (r + (float)(r == 0)); /* never by 0 */
    const float t = .785398163f * ratio, t2 = t * t;
    const float sine =
        t * (1 + t2 * (-1.f / 6 + t2 * (1.f / 120 + t2 * (-1.f / 5040 + t2 * (1.f / 362880)))));
    const float cosine = 1 + t2 * (-.5f + t2 * (1.f / 24 + t2 * (-1.f / 720 + t2 * (1.f / 40320))));
    *dx = r * pick(wide, cosine, sine);
    *dy = r * pick(wide, sine, cosine);
}

void element_sampler_point(const element_sampler *s, float u, float w, float point[3]) {
    int piece = 0;
    if (!s->parallelogram) {
        /* u chooses the triangle and is rescaled to [0, 1); then the square is folded along its diagonal. */
        if (u < s->first_share || !(s->first_share < 1)) { /* u may have been rounded to 1 */
            u = u / s->first_share;
        } else {
            u = (u - s->first_share) / (1 - s->first_share);
            piece = 1;
        }
        /* The halves of the square on either side of its diagonal, each sheared onto half of the triangle:
         * the map preserves area and is continuous (Heitz 2019). */
        const float half = .5f * (u < w ? u : w);
        u -= half;
        w -= half;
    }
    for (int d = 0; d < 3; d++)
        point[d] = s->corner[piece][d] + u * s->edge[piece][0][d] + w * s->edge[piece][1][d];
}

/* The digital shift of the sequence for a pair. */
void pair_sampler_init(pair_sampler *s, uint64_t seed, size_t i, size_t j) {
    uint64_t state = random_hash(random_hash(seed) ^ random_hash((uint64_t)i + 1)) ^
                     random_hash((uint64_t)j + 0x100000001u);
    for (int d = 0; d < 4; d += 2) {
        state = random_hash(state);
        s->shift[d] = (uint32_t)state;
        s->shift[d + 1] = (uint32_t)(state >> 32);
    }
}

void pair_sampler_place(const pair_sampler *s, uint32_t index, double x[4]) {
    for (int d = 0; d < 4; d++) x[d] = (double)(s->shift[d] ^ sobol_coordinate(d, index)) * 0x1p-32;
}

void pair_sampler_packet(const pair_sampler *s, uint32_t first, double x[4][VISIBILITY_PACKET]) {
    for (int d = 0; d < 4; d++) {
        const uint32_t start = s->shift[d] ^ sobol_coordinate(d, first);
        uint32_t at[VISIBILITY_PACKET];
        /* The first three bits of the index. */
        for (uint32_t k = 0; k < VISIBILITY_PACKET; k++) at[k] = start;
        for (int bit = 0; bit < 3; bit++)
            for (uint32_t k = 0; k < VISIBILITY_PACKET; k++)
                at[k] ^= k >> bit & 1 ? sobol_direction[d][bit] : 0;
        for (uint32_t k = 0; k < VISIBILITY_PACKET; k++) x[d][k] = (double)at[k] * 0x1p-32;
    }
}

/* The cells of the square that directions are made of: CELLS of them along each axis. */
enum { CELL_BITS = 4, CELLS = 1 << CELL_BITS, CELL_SHIFT = 32 - CELL_BITS };

/* The place of a cell in Morton order, x and y below CELLS: their bits in turn. */
static inline uint32_t morton(uint32_t x, uint32_t y) {
    uint32_t bits = x | y << 16;
    bits = (bits | bits << 2) & 0x33333333u;
    bits = (bits | bits << 1) & 0x55555555u;
    return (bits & 0xFFFFu) | bits >> 15;
}

void element_sampler_order(const element_sampler *s, uint32_t first, size_t count,
                           uint32_t order[SAMPLE_ORDERED]) {
    uint16_t begin[CELLS * CELLS + 1] = {0};
    uint8_t cell[SAMPLE_ORDERED];
    for (size_t k = 0; k < count; k++) {
        const uint32_t index = first + (uint32_t)k, x = of_low_bits(s, 2, index) ^ of_high_bits(2, index),
                       y = of_low_bits(s, 3, index) ^ of_high_bits(3, index);
        cell[k] = (uint8_t)morton(x >> CELL_SHIFT, y >> CELL_SHIFT);
        begin[cell[k] + 1]++;
    }
    for (size_t c = 0; c < CELLS * CELLS; c++) begin[c + 1] = (uint16_t)(begin[c + 1] + begin[c]);
    for (size_t k = 0; k < count; k++) order[begin[cell[k]]++] = first + (uint32_t)k;
}

void element_sampler_packet(const element_sampler *s, uint32_t first, ray_packet *rays) {
    uint32_t index[VISIBILITY_PACKET];
    for (uint32_t i = 0; i < VISIBILITY_PACKET; i++) index[i] = first + i;
    element_sampler_packet_of(s, index, rays);
}

void element_sampler_packet_of(const element_sampler *s, const uint32_t index[VISIBILITY_PACKET],
                               ray_packet *rays) {
    const element_frame *f = &s->frame;
    float x[4][VISIBILITY_PACKET];
    uint32_t place[4][VISIBILITY_PACKET];
    set_places(s, index, place);
    /* Without the pragma the compiler vectorizes over the axes, not over the rays. */
    for (int d = 0; d < 4; d++)
#pragma omp simd
        for (uint32_t i = 0; i < VISIBILITY_PACKET; i++) x[d][i] = fraction(place[d][i]);

    if (s->parallelogram) {
        for (int d = 0; d < 3; d++)
#pragma omp simd
            for (int i = 0; i < VISIBILITY_PACKET; i++)
                rays->origin[d][i] =
                    s->corner[0][d] + x[0][i] * s->edge[0][0][d] + x[1][i] * s->edge[0][1][d];
    } else {
        for (int i = 0; i < VISIBILITY_PACKET; i++) {
            float origin[3];
            element_sampler_point(s, x[0][i], x[1][i], origin);
            for (int d = 0; d < 3; d++) rays->origin[d][i] = origin[d];
        }
    }
    float dx[VISIBILITY_PACKET], dy[VISIBILITY_PACKET], dz[VISIBILITY_PACKET];
    for (int i = 0; i < VISIBILITY_PACKET; i++) {
        square_to_disc(2 * x[2][i] - 1, 2 * x[3][i] - 1, &dx[i], &dy[i]);
        const float left = 1 - dx[i] * dx[i] - dy[i] * dy[i];
        dz[i] = sqrtf(left > 1e-12f ? left : 1e-12f);
    }
    for (int d = 0; d < 3; d++)
#pragma omp simd
        for (int i = 0; i < VISIBILITY_PACKET; i++)
            rays->direction[d][i] = dx[i] * f->tangent[d] + dy[i] * f->bitangent[d] + dz[i] * f->normal[d];
}

void element_sampler_turn(const element_sampler *s, ray_packet *rays) {
    for (int i = 0; i < VISIBILITY_PACKET; i++) {
        float along = 0;
        for (int d = 0; d < 3; d++) along += rays->direction[d][i] * s->frame.normal[d];
        for (int d = 0; d < 3; d++) rays->direction[d][i] -= 2 * along * s->frame.normal[d];
    }
}
