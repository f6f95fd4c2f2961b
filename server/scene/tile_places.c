#include "server/scene/tile_places.h"

#include "solver/codec/json_writer.h"
#include "store/groups.h"
#include "store/status.h"

#include <math.h>
#include <stdlib.h>

#define DEGREE (M_PI / 180)

/* Columns of /sky/tiles; the first three are the direction of the middle. */
enum { TILE_COLUMNS = 9 };
enum { ALTITUDE_FROM = 3, ALTITUDE_TO, AZIMUTH_FROM, AZIMUTH_TO, SOLID_ANGLE, COSINE };

typedef struct tile_places {
    size_t n_tiles;
    double *tiles; /* [n_tiles][TILE_COLUMNS] */
    char *tiling;  /* its name */
    char *up;      /* "x", "y" or "z" */
    double ground_albedo;
} tile_places;

/* The axes of the scene, with their signs, that are east, north and up. */
static const struct {
    char up;
    int axis[3], sign[3];
} ways[] = {{'x', {1, 2, 0}, {1, 1, 1}}, {'y', {0, 2, 1}, {1, -1, 1}}, {'z', {0, 1, 2}, {1, 1, 1}}};
enum { N_WAYS = sizeof ways / sizeof ways[0] };

static size_t way_of(char up) {
    size_t way = 0;
    while (way < N_WAYS && ways[way].up != up) way++;
    return way;
}

static lam_status check_tiles(const store *s, const tile_places *p, lam_error *error) {
    lam_status status = LAM_OK;
    for (size_t t = 0; t < p->n_tiles; t++) {
        const double *row = p->tiles + t * TILE_COLUMNS;
        for (int k = 0; k < TILE_COLUMNS; k++)
            if (!isfinite(row[k]))
                FAIL(error, LAM_ERR_FORMAT, "%s: /sky/tiles[%zu][%d] is no finite number", store_path(s), t,
                     k);
        if (!(row[SOLID_ANGLE] > 0))
            FAIL(error, LAM_ERR_FORMAT, "%s: /sky/tiles[%zu][%d] = %g, a solid angle must be above 0",
                 store_path(s), t, SOLID_ANGLE, row[SOLID_ANGLE]);
    }
done:
    return status;
}

static bool write_axis(buffer *b, const char *name, size_t way, int which) {
    double v[3] = {0};
    v[ways[way].axis[which]] = ways[way].sign[which];
    return buffer_printf(b, ",\"%s\":", name) && json_write_doubles(b, v, 3);
}

/* Azimuth, from 0 to below 360, and altitude of the middle of a tile. */
static void find_centre(const double *tile, size_t way, double centre[2]) {
    double local[3];
    for (int d = 0; d < 3; d++) local[d] = ways[way].sign[d] * tile[ways[way].axis[d]];
    const double flat = hypot(local[0], local[1]), turn = atan2(local[0], local[1]) / DEGREE;
    centre[0] = flat > 0 ? fmod(turn + 360, 360) : 0;
    centre[1] = atan2(local[2], flat) / DEGREE;
}

static bool write_pairs(buffer *b, const tile_places *p, const char *name, int column) {
    bool written = buffer_printf(b, ",\"%s\":[", name);
    for (size_t t = 0; t < p->n_tiles && written; t++) {
        const double *row = p->tiles + t * TILE_COLUMNS + column;
        written = buffer_append_text(b, t > 0 ? "," : "") &&
                  json_write_doubles(b, (double[]){row[0] / DEGREE, row[1] / DEGREE}, 2);
    }
    return written && buffer_append_text(b, "]");
}

static bool write_column(buffer *b, const tile_places *p, const char *name, int column) {
    bool written = buffer_printf(b, ",\"%s\":[", name);
    for (size_t t = 0; t < p->n_tiles && written; t++)
        written = buffer_append_text(b, t > 0 ? "," : "") &&
                  json_write_double(b, p->tiles[t * TILE_COLUMNS + column]);
    return written && buffer_append_text(b, "]");
}

static bool write_places(const tile_places *p, buffer *b) {
    const size_t way = way_of(p->up[0]);
    bool written = buffer_append_text(b, "\"tiling\":") && json_write_text(b, p->tiling) &&
                   buffer_printf(b, ",\"tiles\":%zu,\"up\":\"%s\"", p->n_tiles, p->up) &&
                   write_axis(b, "east", way, 0) && write_axis(b, "north", way, 1) &&
                   buffer_append_text(b, ",\"ground_albedo\":") && json_write_double(b, p->ground_albedo) &&
                   buffer_append_text(b, ",\"centre\":[");
    for (size_t t = 0; t < p->n_tiles && written; t++) {
        double centre[2];
        find_centre(p->tiles + t * TILE_COLUMNS, way, centre);
        written = buffer_append_text(b, t > 0 ? "," : "") && json_write_doubles(b, centre, 2);
    }
    return written && buffer_append_text(b, "]") && write_pairs(b, p, "azimuth", AZIMUTH_FROM) &&
           write_pairs(b, p, "altitude", ALTITUDE_FROM) && write_column(b, p, "solid_angle", SOLID_ANGLE) &&
           write_column(b, p, "cosine", COSINE);
}

lam_status tile_places_read(store *s, size_t n_tiles, buffer *out, lam_error *error) {
    lam_status status = LAM_OK;
    tile_places p = {.n_tiles = n_tiles};
    buffer written = {0};
    void *tiles = NULL;
    if (!store_has(s, STORE_SKY "/tiles")) return LAM_OK;
    TRY(store_read(s, STORE_SKY "/tiles", STORE_F64, 2, (size_t[]){n_tiles, TILE_COLUMNS}, &tiles, error));
    p.tiles = tiles;
    TRY(check_tiles(s, &p, error));
    TRY(store_get_text(s, STORE_SKY, "tiling", &p.tiling, error));
    TRY(store_get_text(s, STORE_SKY, "up", &p.up, error));
    TRY(store_get_number(s, STORE_SKY, "ground_albedo", &p.ground_albedo, error));
    if (way_of(p.up[0]) == N_WAYS || p.up[1] != '\0')
        FAIL(error, LAM_ERR_FORMAT, "%s: attribute \"up\" of /sky is \"%.20s\", must be x, y or z",
             store_path(s), p.up);
    if (!write_places(&p, &written))
        FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory for the tiles of its sky", store_path(s));
    buffer_trim(&written);
    *out = written;
    written = (buffer){0};
done:
    buffer_free(&written);
    free(p.tiles);
    free(p.tiling);
    free(p.up);
    return status;
}
