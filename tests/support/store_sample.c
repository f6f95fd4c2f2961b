#include "support/store_sample.h"

#include "solver/base/random.h"

size_t sample_bytes(const sample_array *array) {
    size_t bytes = store_type_size(array->type);
    for (int i = 0; i < array->rank; i++) bytes *= array->dims[i];
    return bytes;
}

unsigned char *sample_values(size_t bytes, uint64_t seed) {
    unsigned char *values = malloc(bytes + 1);
    for (size_t i = 0; i < bytes; i++) values[i] = (unsigned char)(random_lcg(&seed) >> 56);
    return values;
}

lam_status sample_fill(store *s, uint64_t salt, lam_error *error) {
    lam_status status = LAM_OK;
    unsigned char *values = NULL;
    for (int i = 0; i < SAMPLE_ARRAYS; i++) {
        const sample_array *array = &sample_arrays[i];
        free(values);
        values = sample_values(sample_bytes(array), salt + (uint64_t)i);
        TRY(store_write(s, array->name, array->type, array->rank, array->dims, values, error));
    }
    TRY(store_write_texts(s, "/mesh/group_names", SAMPLE_TEXTS, sample_texts, error));
    TRY(store_write_texts(s, "/operator/names", 0, NULL, error));
    TRY(store_set_text(s, "/", "name", "sample", error));
    TRY(store_set_integer(s, "/", "seed", INT64_MAX, error));
    TRY(store_set_text(s, "/mesh", "unit", "", error));
    TRY(store_set_number(s, "/mesh/area", "total", 0.1, error));
    /* More than HDF5 keeps in a header by itself, as in /error of a real store. */
    for (int i = 0; i < SAMPLE_NUMBERS; i++) {
        char name[32];
        snprintf(name, sizeof name, "total_%02d", i);
        TRY(store_set_number(s, "/error/single", name, 1.0 / (i + 1), error));
    }
done:
    free(values);
    return status;
}

lam_status sample_write(const char *path, uint64_t salt, lam_error *error) {
    lam_status status = LAM_OK;
    store *s = NULL;
    TRY(store_create(path, &s, error));
    TRY(sample_fill(s, salt, error));
    store *whole = s;
    s = NULL;
    TRY(store_seal(whole, error));
done:
    store_close(s);
    return status;
}

/* FNV-1a. */
static void reading_add(uint64_t *reading, const void *bytes, size_t size) {
    for (size_t i = 0; i < size; i++)
        *reading = (*reading ^ ((const unsigned char *)bytes)[i]) * 0x100000001b3u;
}

static void reading_attribute(void *context, const char *name, const char *text, double number) {
    if (strcmp(name, "created") == 0) return;
    reading_add(context, name, strlen(name) + 1);
    if (text != NULL) reading_add(context, text, strlen(text) + 1);
    if (text == NULL) reading_add(context, &number, sizeof number);
}

lam_status sample_read_open(store *s, uint64_t *out, lam_error *error) {
    static const char *const holders[] = {"/", "/mesh", "/mesh/area", "/error", "/error/single", "/operator"};
    static const char *const absent[] = {"/operator/order", "/sky", "/mesh/area/x", "/error/random"};
    lam_status status = LAM_OK;
    uint64_t reading = 0xcbf29ce484222325u, bytes;
    void *values = NULL;
    char **texts = NULL;
    size_t count;
    for (size_t i = 0; i < sizeof absent / sizeof *absent; i++) {
        bool found = store_has(s, absent[i]) || store_has_attribute(s, "/mesh", absent[i] + 1);
        reading_add(&reading, &found, sizeof found);
    }
    for (size_t i = 0; i < sizeof holders / sizeof *holders; i++)
        TRY(store_each_attribute(s, holders[i], reading_attribute, &reading, error));
    for (int i = 0; i < SAMPLE_ARRAYS; i++) {
        const sample_array *array = &sample_arrays[i];
        size_t dims[STORE_MAX_RANK] = {SIZE_MAX, SIZE_MAX, SIZE_MAX, SIZE_MAX}, size;
        TRY(store_read(s, array->name, array->type, array->rank, dims, &values, error));
        size = store_type_size(array->type);
        for (int j = 0; j < array->rank; j++) size *= dims[j];
        reading_add(&reading, dims, (size_t)array->rank * sizeof *dims);
        reading_add(&reading, values, size);
        free(values);
        values = NULL;
    }
    TRY(store_read_texts(s, "/mesh/group_names", &count, &texts, error));
    for (size_t i = 0; i < count; i++) reading_add(&reading, texts[i], strlen(texts[i]) + 1);
    TRY(store_group_bytes(s, "/operator", &bytes, error));
    reading_add(&reading, &bytes, sizeof bytes);
    *out = reading;
done:
    free(values);
    free(texts);
    return status;
}

lam_status sample_read(const char *path, uint64_t *reading, lam_error *error) {
    lam_status status = LAM_OK;
    store *s = NULL;
    TRY(store_open(path, &s, error));
    TRY(sample_read_open(s, reading, error));
done:
    store_close(s);
    return status;
}

void sample_folder(char path[64]) {
    snprintf(path, 64, "/tmp/lambert-store-XXXXXX");
    if (mkdtemp(path) == NULL) abort();
}

int sample_folder_extras(const char *path, const char *expected) {
    DIR *folder = opendir(path);
    int extras = 0;
    if (folder == NULL) abort();
    for (struct dirent *entry; (entry = readdir(folder)) != NULL;)
        if (strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0 &&
            (expected == NULL || strcmp(entry->d_name, expected) != 0))
            extras++;
    closedir(folder);
    return extras;
}

void sample_folder_remove(const char *path) {
    DIR *folder = opendir(path);
    if (folder == NULL) abort();
    for (struct dirent *entry; (entry = readdir(folder)) != NULL;)
        if (strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0)
            unlinkat(dirfd(folder), entry->d_name, 0);
    closedir(folder);
    rmdir(path);
}

unsigned char *sample_load(const char *path, size_t *size) {
    FILE *file = fopen(path, "rb");
    if (file == NULL) abort();
    fseek(file, 0, SEEK_END);
    *size = (size_t)ftell(file);
    rewind(file);
    unsigned char *bytes = malloc(*size + 1);
    if (fread(bytes, 1, *size, file) != *size) abort();
    fclose(file);
    return bytes;
}

void sample_save(const char *path, const void *bytes, size_t size) {
    FILE *file = fopen(path, "wb");
    if (file == NULL || fwrite(bytes, 1, size, file) != size || fclose(file) != 0) abort();
}
