#include "solver/luminaire/placed_store.h"

#include "store/groups.h"
#include "store/status.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define NO_GROUP 0xFFFFFFFFu

enum { PLACE = 12, OPENING = 8, TABLE = 4 };

/* The groups of luminaires that have one, each name once, and the group of each luminaire. */
static lam_status save_groups(const placed_luminaires *p, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    size_t n = 0;
    const char **names = memory_allocate(p->n, sizeof *names, "groups of luminaires", error);
    uint32_t *group = memory_allocate(p->n, sizeof *group, "groups of luminaires", error);
    if (names == NULL || group == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < p->n; k++) {
        const char *own = p->luminaires[k].group;
        size_t g = n; /* luminaires of a group mostly follow each other */
        group[k] = NO_GROUP;
        if (own[0] == '\0') continue;
        while (g > 0 && strcmp(names[g - 1], own) != 0) g--;
        if (g == 0) names[n++] = own;
        group[k] = (uint32_t)(g == 0 ? n - 1 : g - 1);
    }
    if (n == 0) goto done;
    TRY(store_write_texts(s, STORE_LUMINAIRES "/group_names", n, names, error));
    TRY(store_write(s, STORE_LUMINAIRES "/group", STORE_U32, 1, (size_t[]){p->n}, group, error));
done:
    free(names);
    free(group);
    return status;
}

static lam_status save_names(const placed_luminaires *p, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const char **names = memory_allocate(p->n, sizeof *names, "luminaires", error);
    if (names == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < p->n; k++) names[k] = p->luminaires[k].name;
    TRY(store_write_texts(s, STORE_LUMINAIRES "/names", p->n, names, error));
done:
    free(names);
    return status;
}

/* The numbers of each luminaire. */
static lam_status save_numbers(const placed_luminaires *p, const double *scale, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = p->n;
    double *place = memory_allocate(n, PLACE * sizeof *place, "luminaires", error);
    double *opening = memory_allocate(n, OPENING * sizeof *opening, "luminaires", error);
    double *colour = memory_allocate(n, 3 * sizeof *colour, "luminaires", error);
    double *dim = memory_allocate(n, sizeof *dim, "luminaires", error);
    double *lumens = memory_allocate(n, sizeof *lumens, "luminaires", error);
    uint32_t *table = memory_allocate(n, sizeof *table, "luminaires", error);
    if (place == NULL || opening == NULL || colour == NULL || dim == NULL || lumens == NULL || table == NULL)
        TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < n; k++) {
        const placed_luminaire *l = &p->luminaires[k];
        const luminaire_opening *o = &p->files[l->file].photometry.opening;
        const double *const parts[] = {l->at, l->x, l->y, l->z};
        for (int v = 0; v < 4; v++) memcpy(place + k * PLACE + 3 * v, parts[v], sizeof l->at);
        memcpy(colour + 3 * k, l->colour, sizeof l->colour);
        dim[k] = l->dim;
        lumens[k] = scale[k] * p->files[l->file].lumens;
        table[k] = (uint32_t)l->file;
        if (l->is_point) continue; /* shape and size 0 are a point */
        opening[k * OPENING] = o->shape;
        memcpy(opening + k * OPENING + 1, o->size, sizeof o->size);
        memcpy(opening + k * OPENING + 4, o->side, sizeof o->side);
    }
    TRY(store_write(s, STORE_LUMINAIRES "/place", STORE_F64, 2, (size_t[]){n, PLACE}, place, error));
    TRY(store_write(s, STORE_LUMINAIRES "/opening", STORE_F64, 2, (size_t[]){n, OPENING}, opening, error));
    TRY(store_write(s, STORE_LUMINAIRES "/colour", STORE_F64, 2, (size_t[]){n, 3}, colour, error));
    TRY(store_write(s, STORE_LUMINAIRES "/dimmers", STORE_F64, 1, (size_t[]){n}, dim, error));
    TRY(store_write(s, STORE_LUMINAIRES "/lumens", STORE_F64, 1, (size_t[]){n}, lumens, error));
    TRY(store_write(s, STORE_LUMINAIRES "/scale", STORE_F64, 1, (size_t[]){n}, scale, error));
    TRY(store_write(s, STORE_LUMINAIRES "/table", STORE_U32, 1, (size_t[]){n}, table, error));
done:
    free(place);
    free(opening);
    free(colour);
    free(dim);
    free(lumens);
    free(table);
    return status;
}

/* The tables of all files, one after the other. */
static lam_status save_tables(const placed_luminaires *p, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    size_t planes = 0, angles = 0, candela = 0;
    for (size_t f = 0; f < p->n_files; f++) {
        const luminaire *l = &p->files[f].photometry;
        planes += l->n_planes;
        angles += l->n_angles;
        candela += l->n_planes * l->n_angles;
    }
    const char **names = memory_allocate(p->n_files, sizeof *names, "tables of luminaires", error);
    uint32_t *shape = memory_allocate(p->n_files, TABLE * sizeof *shape, "tables of luminaires", error);
    double *C = memory_allocate(planes, sizeof *C, "tables of luminaires", error);
    double *gamma = memory_allocate(angles, sizeof *gamma, "tables of luminaires", error);
    double *I = memory_allocate(candela, sizeof *I, "tables of luminaires", error);
    if (names == NULL || shape == NULL || C == NULL || gamma == NULL || I == NULL) TRY(LAM_ERR_MEMORY);
    planes = angles = candela = 0;
    for (size_t f = 0; f < p->n_files; f++) {
        const luminaire *l = &p->files[f].photometry;
        const size_t count = l->n_planes * l->n_angles;
        names[f] = p->files[f].name;
        shape[f * TABLE] = (uint32_t)l->type;
        shape[f * TABLE + 1] = (uint32_t)l->symmetry;
        shape[f * TABLE + 2] = (uint32_t)l->n_planes;
        shape[f * TABLE + 3] = (uint32_t)l->n_angles;
        memcpy(C + planes, l->planes, l->n_planes * sizeof *C);
        memcpy(gamma + angles, l->angles, l->n_angles * sizeof *gamma);
        memcpy(I + candela, l->candela, count * sizeof *I);
        planes += l->n_planes;
        angles += l->n_angles;
        candela += count;
    }
    TRY(store_write_texts(s, STORE_LUMINAIRES "/table_names", p->n_files, names, error));
    TRY(store_write(s, STORE_LUMINAIRES "/tables", STORE_U32, 2, (size_t[]){p->n_files, TABLE}, shape,
                    error));
    TRY(store_write(s, STORE_LUMINAIRES "/planes", STORE_F64, 1, &planes, C, error));
    TRY(store_write(s, STORE_LUMINAIRES "/angles", STORE_F64, 1, &angles, gamma, error));
    TRY(store_write(s, STORE_LUMINAIRES "/candela", STORE_F64, 1, &candela, I, error));
done:
    free(names);
    free(shape);
    free(C);
    free(gamma);
    free(I);
    return status;
}

lam_status placed_save(const placed_luminaires *p, const double *scale, size_t n_ignoring,
                       const placed_ignoring *ignoring, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    _Static_assert(sizeof(placed_ignoring) == 2 * sizeof(uint32_t), "it is a row of two numbers");
    TRY(save_names(p, s, error));
    TRY(save_groups(p, s, error));
    TRY(save_numbers(p, scale, s, error));
    TRY(save_tables(p, s, error));
    if (n_ignoring > 0)
        TRY(store_write(s, STORE_LUMINAIRES "/ignore", STORE_U32, 2, (size_t[]){n_ignoring, 2}, ignoring,
                        error));
done:
    return status;
}

static lam_status read_doubles(store *s, const char *name, int rank, size_t *dims, double **out,
                               lam_error *error) {
    void *data = NULL;
    const lam_status status = store_read(s, name, STORE_F64, rank, dims, &data, error);
    if (status == LAM_OK) *out = data;
    return status;
}

/* The parts of a store that become files. */
typedef struct tables_read {
    size_t n, n_names, planes, angles, candela;
    uint32_t *shape;
    char **names;
    double *C, *gamma, *I;
} tables_read;

static void tables_free(tables_read *t) {
    free(t->shape);
    free(t->names);
    free(t->C);
    free(t->gamma);
    free(t->I);
}

static lam_status read_tables(store *s, tables_read *t, lam_error *error) {
    lam_status status = LAM_OK;
    size_t dims[STORE_MAX_RANK] = {SIZE_MAX, TABLE}, planes = 0, angles = 0, candela = 0, count;
    void *data = NULL;
    TRY(store_read(s, STORE_LUMINAIRES "/tables", STORE_U32, 2, dims, &data, error));
    t->shape = data;
    t->n = dims[0];
    TRY(store_read_texts(s, STORE_LUMINAIRES "/table_names", &t->n_names, &t->names, error));
    t->planes = t->angles = t->candela = SIZE_MAX;
    TRY(read_doubles(s, STORE_LUMINAIRES "/planes", 1, &t->planes, &t->C, error));
    TRY(read_doubles(s, STORE_LUMINAIRES "/angles", 1, &t->angles, &t->gamma, error));
    TRY(read_doubles(s, STORE_LUMINAIRES "/candela", 1, &t->candela, &t->I, error));
    for (size_t f = 0; f < t->n; f++) {
        const uint32_t *row = t->shape + f * TABLE;
        if (row[0] >= LUMINAIRE_TYPES || row[1] >= LUMINAIRE_SYMMETRIES ||
            !size_multiply(row[2], row[3], &count))
            FAIL(error, LAM_ERR_FORMAT, "%s: /luminaires/tables[%zu] is no table", store_path(s), f);
        planes += row[2];
        angles += row[3];
        candela += count;
    }
    if (t->n == 0 || t->n_names != t->n || planes != t->planes || angles != t->angles ||
        candela != t->candela)
        FAIL(error, LAM_ERR_FORMAT, "%s: /luminaires/tables does not fit planes, angles and candela",
             store_path(s));
done:
    return status;
}

static lam_status copy_doubles(size_t n, const double *from, double **out, lam_error *error) {
    *out = memory_allocate(n, sizeof **out, "tables of luminaires", error);
    if (*out == NULL) return LAM_ERR_MEMORY;
    memcpy(*out, from, n * sizeof **out);
    return LAM_OK;
}

/* A file for each luminaire's opening and table: openings are of luminaires in a store, and of files here. */
static lam_status make_file(store *s, const tables_read *t, size_t table, const double *opening,
                            placed_file *out, lam_error *error) {
    lam_status status = LAM_OK;
    size_t planes = 0, angles = 0, candela = 0;
    luminaire *l = &out->photometry;
    for (size_t f = 0; f < table; f++) {
        planes += t->shape[f * TABLE + 2];
        angles += t->shape[f * TABLE + 3];
        candela += (size_t)t->shape[f * TABLE + 2] * t->shape[f * TABLE + 3];
    }
    l->type = (luminaire_type)t->shape[table * TABLE];
    l->symmetry = (luminaire_symmetry)t->shape[table * TABLE + 1];
    l->n_planes = t->shape[table * TABLE + 2];
    l->n_angles = t->shape[table * TABLE + 3];
    l->output_ratio = NAN;
    l->opening.shape = (luminaire_shape)opening[0];
    memcpy(l->opening.size, opening + 1, sizeof l->opening.size);
    memcpy(l->opening.side, opening + 4, sizeof l->opening.side);
    out->name = strdup(t->names[table]);
    if (out->name == NULL) FAIL(error, LAM_ERR_MEMORY, "not enough memory for luminaires");
    TRY(copy_doubles(l->n_planes, t->C + planes, &l->planes, error));
    TRY(copy_doubles(l->n_angles, t->gamma + angles, &l->angles, error));
    TRY(copy_doubles(l->n_planes * l->n_angles, t->I + candela, &l->candela, error));
    l->n_sets = 1;
    l->sets = memory_allocate(1, sizeof *l->sets, "luminaires", error);
    if (l->sets == NULL) TRY(LAM_ERR_MEMORY);
    if (!(opening[0] >= 0 && opening[0] < LUMINAIRE_SHAPES) || !luminaire_is_sound(l))
        FAIL(error, LAM_ERR_FORMAT, "%s: /luminaires/tables[%zu] or its opening is no luminaire",
             store_path(s), table);
    out->lumens = luminaire_lumens(l);
done:
    return status;
}

/* Arrays of luminaires. */
typedef struct numbers_read {
    size_t n;
    char **names;
    uint32_t *table, *ignore, *group;
    char **group_names;
    size_t n_ignore, n_groups; /* n_groups: of luminaires */
    double *place, *opening, *colour, *dim, *scale;
} numbers_read;

static void numbers_free(numbers_read *r) {
    free(r->names);
    free(r->table);
    free(r->ignore);
    free(r->group);
    free(r->group_names);
    free(r->place);
    free(r->opening);
    free(r->colour);
    free(r->dim);
    free(r->scale);
}

static lam_status read_groups(store *s, numbers_read *r, lam_error *error) {
    lam_status status = LAM_OK;
    void *data = NULL;
    if (!store_has(s, STORE_LUMINAIRES "/group_names")) goto done;
    TRY(store_read_texts(s, STORE_LUMINAIRES "/group_names", &r->n_groups, &r->group_names, error));
    TRY(store_read(s, STORE_LUMINAIRES "/group", STORE_U32, 1, (size_t[]){r->n}, &data, error));
    r->group = data;
    for (size_t k = 0; k < r->n; k++)
        if (r->group[k] >= r->n_groups && r->group[k] != NO_GROUP)
            FAIL(error, LAM_ERR_FORMAT, "%s: /luminaires/group[%zu] = %u, must be below %zu", store_path(s),
                 k, (unsigned)r->group[k], r->n_groups);
done:
    return status;
}

static lam_status read_numbers(store *s, size_t n_groups, numbers_read *r, lam_error *error) {
    lam_status status = LAM_OK;
    void *data = NULL;
    TRY(store_read_texts(s, STORE_LUMINAIRES "/names", &r->n, &r->names, error));
    TRY(store_read(s, STORE_LUMINAIRES "/table", STORE_U32, 1, (size_t[]){r->n}, &data, error));
    r->table = data;
    TRY(read_doubles(s, STORE_LUMINAIRES "/place", 2, (size_t[]){r->n, PLACE}, &r->place, error));
    TRY(read_doubles(s, STORE_LUMINAIRES "/opening", 2, (size_t[]){r->n, OPENING}, &r->opening, error));
    TRY(read_doubles(s, STORE_LUMINAIRES "/colour", 2, (size_t[]){r->n, 3}, &r->colour, error));
    TRY(read_doubles(s, STORE_LUMINAIRES "/dimmers", 1, (size_t[]){r->n}, &r->dim, error));
    TRY(read_doubles(s, STORE_LUMINAIRES "/scale", 1, (size_t[]){r->n}, &r->scale, error));
    TRY(read_groups(s, r, error));
    if (!store_has(s, STORE_LUMINAIRES "/ignore")) goto done;
    size_t dims[STORE_MAX_RANK] = {SIZE_MAX, 2};
    TRY(store_read(s, STORE_LUMINAIRES "/ignore", STORE_U32, 2, dims, &data, error));
    r->ignore = data;
    r->n_ignore = dims[0];
    for (size_t i = 0; i < r->n_ignore; i++)
        if (r->ignore[2 * i] >= r->n || r->ignore[2 * i + 1] >= n_groups ||
            (i > 0 && r->ignore[2 * i] < r->ignore[2 * i - 2]))
            FAIL(error, LAM_ERR_FORMAT, "%s: /luminaires/ignore[%zu] is no luminaire and group in order",
                 store_path(s), i);
done:
    return status;
}

/* The file of a table and an opening, made where there is none yet. */
static lam_status find_file(store *s, const tables_read *t, const numbers_read *r, size_t k,
                            placed_luminaires *p, size_t *of_file, lam_error *error) {
    lam_status status = LAM_OK;
    const double *opening = r->opening + k * OPENING;
    if (r->table[k] >= t->n)
        FAIL(error, LAM_ERR_FORMAT, "%s: /luminaires/table[%zu] = %u, must be below %zu", store_path(s), k,
             (unsigned)r->table[k], t->n);
    size_t f = p->n_files;
    while (f > 0 &&
           (of_file[f - 1] != r->table[k] || (double)p->files[f - 1].photometry.opening.shape != opening[0] ||
            memcmp(p->files[f - 1].photometry.opening.size, opening + 1, 3 * sizeof *opening) != 0 ||
            memcmp(p->files[f - 1].photometry.opening.side, opening + 4, 4 * sizeof *opening) != 0))
        f--;
    p->luminaires[k].file = f > 0 ? f - 1 : p->n_files;
    if (f > 0) goto done;
    of_file[p->n_files] = r->table[k];
    TRY(make_file(s, t, r->table[k], opening, &p->files[p->n_files++], error));
done:
    return status;
}

static void take_luminaire(const numbers_read *r, size_t k, placed_luminaires *p) {
    placed_luminaire *l = &p->luminaires[k];
    const placed_file *f = &p->files[l->file];
    double *const parts[] = {l->at, l->x, l->y, l->z};
    for (int v = 0; v < 4; v++) memcpy(parts[v], r->place + k * PLACE + 3 * v, sizeof l->at);
    memcpy(l->colour, r->colour + 3 * k, sizeof l->colour);
    if (r->group != NULL && r->group[k] != NO_GROUP)
        snprintf(l->group, sizeof l->group, "%s", r->group_names[r->group[k]]);
    l->dim = r->dim[k];
    l->maintenance = 1;
    l->flux = f->lumens > 0 ? r->scale[k] * f->lumens : (double)NAN;
    l->scale = l->dim * r->scale[k];
    l->is_point = f->photometry.opening.shape == OPENING_POINT;
    l->entry = k;
}

lam_status placed_load(store *s, size_t n_groups, char *const *group_names, placed_luminaires *out,
                       lam_error *error) {
    lam_status status = LAM_OK;
    tables_read t = {.n = 0};
    numbers_read r = {.n = 0};
    placed_luminaires p = {.n = 0};
    size_t *of_file = NULL, at = 0;
    if (!store_has(s, STORE_LUMINAIRES)) goto done;
    TRY(read_numbers(s, n_groups, &r, error));
    TRY(read_tables(s, &t, error));
    p.luminaires = memory_allocate(r.n, sizeof *p.luminaires, "luminaires", error);
    p.files = memory_allocate(r.n, sizeof *p.files, "luminaires", error);
    p.ignored = memory_allocate(r.n_ignore, sizeof *p.ignored, "luminaires", error);
    of_file = memory_allocate(r.n, sizeof *of_file, "luminaires", error);
    if (p.luminaires == NULL || p.files == NULL || p.ignored == NULL || of_file == NULL) TRY(LAM_ERR_MEMORY);
    p.n = r.n;
    for (size_t k = 0; k < r.n; k++) {
        placed_luminaire *l = &p.luminaires[k];
        snprintf(l->name, sizeof l->name, "%s", r.names[k]);
        TRY(find_file(s, &t, &r, k, &p, of_file, error));
        take_luminaire(&r, k, &p);
        l->ignored = p.n_ignored;
        for (; at < r.n_ignore && r.ignore[2 * at] == k; at++) {
            snprintf(p.ignored[p.n_ignored++].text, PLACED_IGNORED, "%s", group_names[r.ignore[2 * at + 1]]);
            l->n_ignored++;
        }
    }
done:
    if (status == LAM_OK) {
        *out = p;
        p = (placed_luminaires){.n = 0};
    }
    tables_free(&t);
    numbers_free(&r);
    placed_free(&p);
    free(of_file);
    return status;
}

static bool same_table(const luminaire *a, const luminaire *b) {
    return a->type == b->type && a->symmetry == b->symmetry && a->n_planes == b->n_planes &&
           a->n_angles == b->n_angles && memcmp(a->planes, b->planes, a->n_planes * sizeof *a->planes) == 0 &&
           memcmp(a->angles, b->angles, a->n_angles * sizeof *a->angles) == 0 &&
           memcmp(a->candela, b->candela, a->n_planes * a->n_angles * sizeof *a->candela) == 0;
}

static bool same_opening(const placed_luminaire *a, const luminaire_opening *of_a, const placed_luminaire *b,
                         const luminaire_opening *of_b) {
    const bool point_a = a->is_point || of_a->shape == OPENING_POINT;
    const bool point_b = b->is_point || of_b->shape == OPENING_POINT;
    if (point_a || point_b) return point_a && point_b;
    return of_a->shape == of_b->shape && memcmp(of_a->size, of_b->size, sizeof of_a->size) == 0 &&
           memcmp(of_a->side, of_b->side, sizeof of_a->side) == 0;
}

bool placed_lights_alike(const placed_luminaires *a, size_t i, const placed_luminaires *b, size_t j) {
    const placed_luminaire *l = &a->luminaires[i], *k = &b->luminaires[j];
    const luminaire *of_l = &a->files[l->file].photometry, *of_k = &b->files[k->file].photometry;
    return memcmp(l->at, k->at, sizeof l->at) == 0 && memcmp(l->x, k->x, sizeof l->x) == 0 &&
           memcmp(l->y, k->y, sizeof l->y) == 0 && memcmp(l->z, k->z, sizeof l->z) == 0 &&
           same_opening(l, &of_l->opening, k, &of_k->opening) && same_table(of_l, of_k);
}
