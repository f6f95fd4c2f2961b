/* The sources of form factors. A recipe names one, which says by columns of its table how it is described,
 * what it gives, costs and errs, and how it gets finer: no other file compares sources by name, but the plan
 * that weighs them. A new one is a folder with its table, and a row of sources.c. */
#ifndef LAMBERT_FORMFACTOR_SOURCE_H
#define LAMBERT_FORMFACTOR_SOURCE_H

#include "solver/formfactor/factor_cost.h"
#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/recipe.h"
#include "solver/formfactor/visibility/visibility.h"

enum {
    SOURCE_ROWS = 1 << 0,        /* finds rows of F (form_factors_make) */
    SOURCE_STREAM = 1 << 1,      /* finds them one after the other, too (ray_rows.h) */
    SOURCE_BLOCKS = 1 << 2,      /* finds blocks of clusters (form_factors_make_blocks) */
    SOURCE_TWICE = 1 << 3,       /* finds both samples of a judge together (form_factors_make_twice) */
    SOURCE_LARGE = 1 << 4,       /* its rows may lie in files */
    SOURCE_NOISE = 1 << 5,       /* the noise of its rays is in all of F (recipe_noise) */
    SOURCE_RAYS = 1 << 6,        /* recipe.rays are cast from every element and fill F */
    SOURCE_RESOLUTION = 1 << 7,  /* recipe.resolution is its own, and rays are none of its own */
    SOURCE_ACCURACY = 1 << 8,    /* recipe.accuracy is its own */
    SOURCE_TIMED = 1 << 9,       /* the measured rate of rays says more of its time than a sample's counts */
    SOURCE_BY_EPSILON = 1 << 10, /* --epsilon decides its accuracy, whatever else is asked for */
    SOURCE_COARSER = 1 << 11,    /* an operator's --epsilon may make it coarser (recipe_coarser) */
    SOURCE_ASKED = 1 << 12       /* --form-factors asks for it by its name */
};

/* Where the rows of a sample lie while they are found and merged. */
typedef enum factor_place { FACTORS_IN_MEMORY, FACTORS_FOUND_ON_DISK, FACTORS_ON_DISK } factor_place;

/* The scene that a sample is taken of. */
typedef struct factor_work {
    const mesh *m;
    const progress *progress;
    const plane_tree *tree;     /* of blocks: of the elements */
    struct block_scene **ready; /* of blocks: the mesh on that tree, made where it is NULL and left there */
    importance *importance;     /* of blocks; n is 0 where all is read, and emits */
} factor_work;

/* The knobs that a finer recipe may turn. */
typedef struct factor_knobs {
    bool rays, accuracy;
    double finest; /* accuracy of pairs */
} factor_knobs;

/* Of n elements. Bytes and seconds without a sample are by laws that were fitted to scenes; the constants
 * stand beside them. */
typedef struct factor_source {
    const char *name; /* "near-pairs": in stores */
    unsigned flags;
    void (*describe)(const recipe *r, char text[64]); /* "4096 rays per element" */
    void (*option)(const recipe *r, char text[40]);   /* "--rays 4096" */
    double (*accuracy)(const recipe *r); /* recipe_accuracy, where it is not recipe.accuracy; or NULL */
    double (*repair)(const recipe *r);   /* the mean repair of row sums that its samples make by themselves */
    recipe (*judge)(const recipe *r, size_t rays); /* recipe_of_judge, but for seed and closure */
    /* Its recipe where --form-factors asks for it, of rays, resolution, seed and closure that options ask
     * for; NULL: the plan weighs it against others. */
    recipe (*asked)(const recipe *r);

    double (*rays)(double n, const recipe *r);         /* that are cast from an element */
    double (*blocks)(double n, const recipe *r);       /* their number; NULL: rows */
    double (*bytes)(double n, const recipe *r);        /* of its rows or blocks, merged and expanded */
    double (*packed_bytes)(double n, const recipe *r); /* of rows as they are found */
    double (*making_bytes)(double n, const recipe *r,
                           factor_place place);        /* at the peak while it finds them */
    double (*stream_bytes)(double n, const recipe *r); /* beside a stream; NULL: none */
    double (*stored_bytes)(double n, const recipe *r); /* of the rows or blocks in a store */
    /* Processor seconds without a sample; entries: of the triangle, or 0 where they are not known; a ray
     * takes ray_seconds, all else as long as its constants say times slowness. */
    double (*seconds)(double n, const recipe *r, double entries, double ray_seconds, double slowness);
    /* The cost by a sample; NULL: there is none. Errors: LAM_ERR_MEMORY, LAM_ERR_CANCELLED. */
    lam_status (*sample)(const factor_work *w, const recipe *r, factor_cost *out, lam_error *error);

    /* Rows by a recipe that was checked, into f->upper, repaired; NULL: none. */
    lam_status (*make)(const mesh *m, const visibility *v, const uint32_t *order,
                       const form_factor_options *options, form_factors *f, lam_error *error);

    bool (*less)(recipe *r); /* about half of the work, for less memory; false: it is little already */
    /* Turns the knobs so far that an error becomes the one wanted below it; within a factor of 64. */
    void (*finer)(recipe *r, double error, double wanted, const factor_knobs *knobs);
    /* The option that takes an error down to most. finest: knobs are at their end. */
    void (*advise)(const recipe *r, double error, double most, bool finest, char option[64]);
} factor_source;

extern const factor_source source_rays, source_hemicube, source_pairs, source_near_pairs, source_blocks;

/* The list; NULL behind the last. A new source is the last. */
const factor_source *source_at(size_t k);
const factor_source *source_find(const char *name); /* NULL: none */

/* The words of --form-factors: "auto", and the names of the sources that it asks for. The source at a place
 * among them, NULL: auto; and the place of a source. */
enum { SOURCE_WORDS_BYTES = 128 };
void source_words(char words[SOURCE_WORDS_BYTES]);
const factor_source *source_asked(unsigned place);
unsigned source_place(const factor_source *asked);

/* The place of a recipe's source in the list, by which scratch files know it. */
size_t source_number(const recipe *r);

/* The source of a recipe. */
const factor_source *recipe_source(const recipe *r);
bool recipe_can(const recipe *r, unsigned flag);

/* True where two recipes give other bits on one mesh. */
bool recipes_differ(const recipe *a, const recipe *b);

/* The factor by which a knob takes an error, which is as its power, from one value to another below it: from
 * 1/64 to 64. */
double source_turn(double from, double to, double power);

/* The column `rays` of a source that casts recipe.rays from every element. */
double source_rays_given(double n, const recipe *r);

/* Laws that sources of rows share. Bytes of the rows of one merged sample: a pair is seen from either end, so
 * rows have on average at most twice as many entries as an element has rays, an index and a value each. Bytes
 * of packed rows: a gap in groups of seven bits, of which one bit marks a count above 1, or a weight; the
 * row's own figures. Bytes at the peak: packed rows and the triangle that they are merged into, or the
 * triangle and the rows made of it. Seconds of rows from rays. Bytes in a store, which keeps the triangle of
 * many. */
double rows_bytes(double n, double rays);
double rows_packed_bytes(double n, double rays, bool weights);
double rows_making_bytes(double sample, double packed, factor_place place);
double rows_seconds(double n, double rays, double entries, double ray_seconds, double slowness);
double rows_stored_bytes(double n, double rows);

#endif
