/* A small store with one of everything, and a reading of a whole store boiled down to one number. */
#ifndef LAMBERT_TESTS_STORE_SAMPLE_H
#define LAMBERT_TESTS_STORE_SAMPLE_H

#include "store/status.h"
#include "store/store.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* One array of the sample: values are a fixed sequence. */
typedef struct sample_array {
    const char *name;
    store_type type;
    int rank;
    size_t dims[STORE_MAX_RANK];
} sample_array;

static const sample_array sample_arrays[] = {
    {"/mesh/vertices", STORE_F64, 2, {19, 3}},
    {"/mesh/elements", STORE_U32, 2, {23, 4}},
    {"/mesh/area", STORE_F64, 1, {23}},
    {"/mesh/normal", STORE_F32, 2, {23, 3}},
    {"/operator/core", STORE_F32, 3, {3, 5, 5}},
    {"/operator/deep", STORE_F64, 4, {2, 3, 4, 5}},
    {"/form_factors/indptr", STORE_U64, 1, {24}},
    {"/form_factors/indices", STORE_U32, 1, {0}},
    {"/form_factors/data", STORE_F32, 4, {4, 0, 2, 1}},
};
enum { SAMPLE_ARRAYS = sizeof sample_arrays / sizeof *sample_arrays };

static const char *const sample_texts[] = {"floor", "Wände", "ceiling ☼", "", "x"};
enum { SAMPLE_TEXTS = sizeof sample_texts / sizeof *sample_texts, SAMPLE_NUMBERS = 16 };

size_t sample_bytes(const sample_array *array);

/* Any bytes are a value of any of the four types: a linear congruential sequence. The caller frees. */
unsigned char *sample_values(size_t bytes, uint64_t seed);

/* Fills an open store; salt makes another content of the same shape. */
lam_status sample_fill(store *s, uint64_t salt, lam_error *error);

lam_status sample_write(const char *path, uint64_t salt, lam_error *error);

/* Everything the sample has and a few things it has not, in one number. */
lam_status sample_read_open(store *s, uint64_t *out, lam_error *error);

lam_status sample_read(const char *path, uint64_t *reading, lam_error *error);

/* A fresh folder in path [64]. */
void sample_folder(char path[64]);

/* Removes a folder with files in it; how many names there were but those of `expected` (may be NULL). */
int sample_folder_extras(const char *path, const char *expected);

void sample_folder_remove(const char *path);

/* The bytes of a file; the caller frees. */
unsigned char *sample_load(const char *path, size_t *size);

void sample_save(const char *path, const void *bytes, size_t size);

#endif
