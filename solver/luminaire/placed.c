/* A list of luminaires is read, and then the files that it names, each in a child of its own. */
#include "solver/luminaire/placed.h"

#include "solver/base/asset_files.h"
#include "solver/base/file_text.h"
#include "solver/luminaire/placed_parts.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

void placed_free(placed_luminaires *p) {
    for (size_t k = 0; k < p->n_files; k++) {
        free(p->files[k].name);
        free(p->files[k].path);
        luminaire_free(&p->files[k].photometry);
    }
    free(p->files);
    free(p->luminaires);
    free(p->ignored);
    *p = (placed_luminaires){0};
}

double placed_lumens(const placed_luminaires *p, const placed_luminaire *l) {
    return l->scale * p->files[l->file].lumens;
}

/* True for a text that begins as an object of JSON does, or an array of them. */
static bool begins_as_json(const luminaire_source *s) {
    const char *begin = s->text, *end = s->end;
    luminaire_trim(&begin, &end);
    if (begin < end && *begin == '[') begin++;
    luminaire_trim(&begin, &end);
    return begin < end && *begin == '{';
}

bool placed_is_list(const char *path) {
    enum { HEAD = 65536 };
    struct stat about;
    luminaire_source s;
    bool is_list = false;
    if (stat(path, &about) != 0 || !S_ISREG(about.st_mode)) return false;
    FILE *file = fopen(path, "rb");
    char *head = malloc(HEAD);
    const size_t length = file != NULL && head != NULL ? fread(head, 1, HEAD, file) : 0;
    if (file != NULL) fclose(file);
    if (luminaire_source_open(path, head, length, &s, NULL) == LAM_OK && !lm63_is_it(&s)) {
        const bool named = luminaire_is_named(path, ".json") || luminaire_is_named(path, ".csv");
        is_list = begins_as_json(&s) || placed_csv_is_it(&s) || (named && !eulumdat_is_it(&s));
    }
    free(head);
    return is_list;
}

/* "files": words for paths. */
static lam_status check_files(placed_reading *r, json_t *files, lam_error *error) {
    lam_status status = LAM_OK;
    char shown[LIST_SHOWN], word[LIST_SHOWN];
    const char *key;
    json_t *value;
    r->files = files;
    if (files == NULL) return LAM_OK;
    if (!json_is_object(files)) {
        list_shown(files, shown);
        FAIL(error, LAM_ERR_ARGUMENT, "%.200s: files = %s, must be an object of words and paths", r->name,
             shown);
    }
    json_object_foreach(files, key, value) {
        if (json_is_string(value) && json_string_length(value) > 0) continue;
        list_shown(value, shown);
        luminaire_clean(key, key + strlen(key), word, sizeof word);
        FAIL(error, LAM_ERR_ARGUMENT, "%.200s: files.%s = %s, must be a path", r->name, word, shown);
    }
done:
    return status;
}

/* A word of "files" that no luminaire has may be misspelt in one. */
static void warn_of_files(const placed_reading *r) {
    char shown[LIST_SHOWN];
    const char *key;
    json_t *value;
    json_object_foreach(r->files, key, value) {
        size_t k = 0;
        while (k < r->out->n_files && strcmp(r->out->files[k].name, json_string_value(value)) != 0) k++;
        luminaire_clean(key, key + strlen(key), shown, sizeof shown);
        if (k == r->out->n_files)
            luminaire_warnings_add(&r->out->warnings, "no luminaire has the file %s", shown);
    }
}

static lam_status read_json(const luminaire_source *s, placed_reading *r, lam_error *error) {
    static const char *const words[] = {"unit", "files", "luminaires"};
    lam_status status = LAM_OK;
    char shown[LIST_SHOWN], place[PLACED_PLACE];
    json_t *root = NULL;
    TRY(list_open(s, &root, error));
    snprintf(place, sizeof place, "%.200s: the file", s->name);
    TRY(list_members(root, sizeof words / sizeof *words, words, place, error));
    TRY(list_unit(r->name, json_object_get(root, "unit"), &r->unit, error));
    TRY(check_files(r, json_object_get(root, "files"), error));
    const json_t *list = json_object_get(root, "luminaires");
    const size_t n = json_array_size(list);
    if (n == 0 || n > PLACED_MOST) {
        list_shown(list, shown);
        FAIL(error, LAM_ERR_ARGUMENT, "%.200s: luminaires = %s, must be an array of 1 to %d luminaires",
             s->name, shown, PLACED_MOST);
    }
    for (size_t k = 0; k < n; k++) TRY(placed_entry(r, json_array_get(list, k), k, error));
    warn_of_files(r);
done:
    r->files = NULL;
    json_decref(root);
    return status;
}

static int by_name(const void *a, const void *b) {
    const placed_luminaire *const *first = a, *const *second = b;
    const int order = strcmp((*first)->name, (*second)->name);
    /* Equal names stand as in the list, so that messages do not depend on the sort. */
    return order != 0 ? order : (*first > *second) - (*first < *second);
}

static int compare_name(const void *key, const void *item) {
    return strcmp(key, (*(const placed_luminaire *const *)item)->name);
}

/* A name stands for one luminaire, or for the luminaires of a group. */
static lam_status check_names(const placed_luminaires *p, const char *name, lam_error *error) {
    lam_status status = LAM_OK;
    char place[PLACED_PLACE], other[PLACED_PLACE];
    const placed_luminaire **sorted = memory_allocate(p->n, sizeof *sorted, name, error);
    if (sorted == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < p->n; k++) sorted[k] = &p->luminaires[k];
    qsort(sorted, p->n, sizeof *sorted, by_name);
    for (size_t k = 1; k < p->n; k++) {
        if (strcmp(sorted[k]->name, sorted[k - 1]->name) != 0) continue;
        placed_place(name, p->is_csv, sorted[k]->entry, place);
        placed_place("the list", p->is_csv, sorted[k - 1]->entry, other);
        FAIL(error, LAM_ERR_ARGUMENT, "%s: name = %s, which %s has too", place, sorted[k]->name,
             other + strlen("the list: "));
    }
    for (size_t k = 0; k < p->n; k++) {
        const char *group = p->luminaires[k].group;
        const placed_luminaire *const *same = bsearch(group, sorted, p->n, sizeof *sorted, compare_name);
        if (same == NULL) continue;
        placed_place(name, p->is_csv, p->luminaires[k].entry, place);
        placed_place("the list", p->is_csv, (*same)->entry, other);
        FAIL(error, LAM_ERR_ARGUMENT, "%s: group = %s, which is the name of %s", place, group,
             other + strlen("the list: "));
    }
done:
    free(sorted);
    return status;
}

static lam_status too_large(const char *name, size_t length, lam_error *error) {
    return status_fail(error, LAM_ERR_FORMAT,
                       "%.200s: has %zu bytes, more than the %zu MiB that a list of luminaires may have",
                       name, length, PLACED_BYTES_MOST >> 20);
}

lam_status placed_read_text(const char *name, const char *text, size_t length, const placed_options *options,
                            placed_luminaires *out, lam_error *error) {
    lam_status status = LAM_OK;
    luminaire_source s;
    placed_luminaires p = {.n = 0};
    placed_reading r = {
        .name = name, .out = &p, .up = options->up, .unit = options->unit > 0 ? options->unit : 1};
    if (length > PLACED_BYTES_MOST) TRY(too_large(name, length, error));
    TRY(luminaire_source_open(name, text, length, &s, error));
    p.is_csv = !begins_as_json(&s) && (placed_csv_is_it(&s) || !luminaire_is_named(name, ".json"));
    if (p.is_csv) {
        TRY(placed_csv(&s, &r, error));
    } else {
        TRY(read_json(&s, &r, error));
    }
    if (p.n == 0)
        FAIL(error, LAM_ERR_ARGUMENT, "%.200s: has no luminaire, must have 1 to %d", name, PLACED_MOST);
    TRY(check_names(&p, name, error));
    *out = p;
    p = (placed_luminaires){.n = 0};
done:
    placed_free(&p);
    return status;
}

/* Reads the file k of a list, unless one before it is the same; *same becomes the place of that one, or k. */
static lam_status read_file(placed_luminaires *p, size_t k, const char *name, const placed_options *options,
                            size_t *same, lam_error *error) {
    lam_status status = LAM_OK;
    placed_file *f = &p->files[k];
    char found[ASSET_PATH], place[PLACED_PLACE];
    lam_error why = {.message = ""};
    placed_place(name, p->is_csv, f->entry, place);
    const asset_place where = asset_find(name, options->assets, f->name, found);
    if (where == ASSET_SEVERAL)
        FAIL(error, LAM_ERR_ARGUMENT, "%s: file %s may be either of %s", place, f->name, found);
    if (where != ASSET_FOUND)
        FAIL(error, LAM_ERR_ARGUMENT, "%s: file %.200s %s", place, f->name,
             where == ASSET_OUTSIDE
                 ? "lies outside of the list's folder; --assets with its folder lets it be read"
                 : "is not there: put it beside the list, or name its folder by --assets");
    f->path = realpath(found, NULL);
    if (f->path == NULL)
        FAIL(error, LAM_ERR_IO, "%s: file %.200s: cannot read: %s", place, f->name, strerror(errno));
    for (*same = 0; *same < k; ++*same)
        if (p->files[*same].set == f->set && p->files[*same].path != NULL &&
            strcmp(p->files[*same].path, f->path) == 0)
            goto done;
    const luminaire_options own = {.set = f->set, .assets = options->assets};
    status = luminaire_read(found, &own, &f->photometry, &why);
    const char *option = strstr(why.message, "--set ");
    if (status == LAM_ERR_ARGUMENT && option != NULL)
        FAIL(error, status, "%s: lamp_set = %s", place, option + strlen("--set "));
    if (status != LAM_OK) FAIL(error, status, "%s", why.message);
    f->lumens = luminaire_lumens(&f->photometry);
done:
    return status;
}

/* Reads all files and keeps each once. */
static lam_status read_files(placed_luminaires *p, const char *name, const placed_options *options,
                             lam_error *error) {
    lam_status status = LAM_OK;
    size_t kept = 0;
    size_t *place = memory_allocate(p->n_files, sizeof *place, name, error);
    if (place == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < p->n_files; k++) TRY(read_file(p, k, name, options, &place[k], error));
    for (size_t k = 0; k < p->n_files; k++) {
        if (place[k] == k) {
            place[k] = kept;
            p->files[kept++] = p->files[k];
        } else {
            place[k] = place[place[k]];
            free(p->files[k].name);
            free(p->files[k].path);
        }
    }
    p->n_files = kept;
    for (size_t k = 0; k < p->n; k++) p->luminaires[k].file = place[p->luminaires[k].file];
done:
    free(place);
    return status;
}

/* The factors that make the flux of each luminaire what the list says. */
static lam_status apply_fluxes(placed_luminaires *p, const char *name, lam_error *error) {
    lam_status status = LAM_OK;
    char place[PLACED_PLACE];
    for (size_t k = 0; k < p->n; k++) {
        placed_luminaire *l = &p->luminaires[k];
        const placed_file *f = &p->files[l->file];
        if (isnan(l->flux)) continue;
        placed_place(name, p->is_csv, l->entry, place);
        if (!(f->lumens > 0))
            FAIL(error, LAM_ERR_ARGUMENT, "%s: flux = %g, but all candela of %.200s are 0", place, l->flux,
                 f->name);
        l->scale *= l->flux / f->lumens;
    }
done:
    return status;
}

lam_status placed_read(const char *path, const placed_options *options, placed_luminaires *out,
                       lam_error *error) {
    lam_status status = LAM_OK;
    placed_luminaires p = {.n = 0};
    struct stat about;
    char *text = NULL;
    size_t length = 0;
    if (stat(path, &about) == 0 && S_ISREG(about.st_mode) && about.st_size > (off_t)PLACED_BYTES_MOST)
        TRY(too_large(path, (size_t)about.st_size, error));
    TRY(file_text(path, &text, &length, error));
    TRY(placed_read_text(path, text, length, options, &p, error));
    TRY(read_files(&p, path, options, error));
    TRY(apply_fluxes(&p, path, error));
    *out = p;
    p = (placed_luminaires){.n = 0};
done:
    free(text);
    placed_free(&p);
    return status;
}
