/* The list of the sources of form factors, and what a recipe knows by its own. */
#include "solver/formfactor/source.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static const factor_source *const SOURCE_LIST[] = {
    &source_rays, &source_hemicube, &source_pairs, &source_near_pairs, &source_blocks, NULL,
};

const factor_source *source_at(size_t k) {
    return SOURCE_LIST[k];
}

const factor_source *source_find(const char *name) {
    size_t k = 0;
    while (SOURCE_LIST[k] != NULL && strcmp(SOURCE_LIST[k]->name, name) != 0) k++;
    return SOURCE_LIST[k];
}

void source_words(char words[SOURCE_WORDS_BYTES]) {
    size_t length = (size_t)sprintf(words, "auto");
    const factor_source *s;
    for (unsigned place = 1; (s = source_asked(place)) != NULL; place++) {
        length += (size_t)snprintf(words + length, SOURCE_WORDS_BYTES - length, "|%s", s->name);
        assert(length < SOURCE_WORDS_BYTES);
    }
}

const factor_source *source_asked(unsigned place) {
    for (size_t k = 0; SOURCE_LIST[k] != NULL; k++)
        if ((SOURCE_LIST[k]->flags & SOURCE_ASKED) && --place == 0) return SOURCE_LIST[k];
    return NULL;
}

unsigned source_place(const factor_source *asked) {
    unsigned place = 1;
    while (source_asked(place) != NULL && source_asked(place) != asked) place++;
    return source_asked(place) != NULL ? place : 0;
}

size_t source_number(const recipe *r) {
    size_t k = 0;
    while (SOURCE_LIST[k] != recipe_source(r)) k++;
    return k;
}

const factor_source *recipe_source(const recipe *r) {
    return r->source != NULL ? r->source : &source_rays;
}

bool recipe_can(const recipe *r, unsigned flag) {
    return (recipe_source(r)->flags & flag) != 0;
}

bool recipes_differ(const recipe *a, const recipe *b) {
    return recipe_source(a) != recipe_source(b) || a->rays != b->rays || a->resolution != b->resolution ||
           a->accuracy != b->accuracy || a->seed != b->seed;
}

double source_rays_given(double n, const recipe *r) {
    (void)n;
    return (double)r->rays;
}

double source_turn(double from, double to, double power) {
    static const double most = 64;
    return fmin(fmax(pow(to / from, 1 / power), 1 / most), most);
}

double rows_bytes(double n, double rays) {
    return n * fmin(n, 2 * rays) * 8;
}

double rows_packed_bytes(double n, double rays, bool weights) {
    const double entries = fmin(n, rays), gap = n / fmax(1, entries);
    const double bytes = 1 + floor(log2(fmax(1, gap)) / 7 + 2. / 7) + (weights ? 4 : rays > n / 4 ? 1 : 0);
    return n * (entries * bytes + 24);
}

/* Memory of a panel of rows that is merged or expanded. */
static const double merge_bytes = 128e6;

double rows_making_bytes(double sample, double packed, factor_place place) {
    const double some = fmin(merge_bytes, sample);
    if (place == FACTORS_ON_DISK) return some;
    return fmax(sample, (place == FACTORS_IN_MEMORY ? packed : 0) + sample / 2) + some;
}

/* Processor seconds per entry of the triangle, beside rays: packing, merging, sweeps, expanding; of a row of
 * rays. Entries of the triangle per ray where no sample tells: many rays hit what others hit. */
static const double merge_seconds = 6e-8, row_seconds = 2.4e-5, ray_entries = .3;

double rows_seconds(double n, double rays, double entries, double ray_seconds, double slowness) {
    const double all = n * rays, merged = entries > 0 ? entries : fmin(n * n / 2, ray_entries * all);
    return all * ray_seconds + (n * row_seconds + merged * merge_seconds) * slowness;
}

double rows_stored_bytes(double n, double rows) {
    return n > FORM_FACTORS_ROWS_MOST ? rows / 2 : rows;
}
