/* From a scene (or a store with form factors) to a sealed store: the stages in their order. */
#ifndef LAMBERT_PRECOMPUTE_PRECOMPUTE_H
#define LAMBERT_PRECOMPUTE_PRECOMPUTE_H

#include "solver/base/terminal.h"
#include "solver/method/classify.h"
#include "solver/precompute/recipe_choice.h"
#include "solver/scene/mesh.h"

/* Where --levels auto and --probes auto are still open. */
#define PRECOMPUTE_AUTO UINT64_MAX

typedef struct precompute_options {
    const char *input, *output;
    bool from_store;
    const char *command; /* for the record */
    mesh_refinement refinement;
    double unit;
    char up; /* 0: by the file */
    bool two_sided;
    double reflectance;          /* negative: the file's own */
    choice_request form_factors; /* from a store: of the judge only */
    const char *sky;             /* a tiling, or NULL; from a store: that of the store */
    double ground_albedo;
    uint64_t probes;
    bool keep_form_factors;
    bool compress_form_factors; /* those that are kept */
    const char *method, *factorizer;
    double epsilon, alpha;
    const char *budget;         /* "squares", ... */
    uint64_t seed;              /* of random sketches */
    uint64_t levels;            /* PRECOMPUTE_AUTO */
    uint64_t rank;              /* 0: by epsilon */
    double coherence, min_area; /* of 2msc; 0: not given */
    bool proximity;             /* of 2msc */
    double threshold;           /* of sparse; 0 with auto: what suits epsilon */
    const char *correction;     /* of sparse: "none", "delta", "discarded" */
    const char *emitters;       /* FILE, group=NAME, sky; or NULL */
    bool keep_factors;          /* also of one channel */
    panel_precision precision;  /* of the stored operator */
    uint64_t memory;            /* bytes; 0: 70 % of what is free */
    const char *scratch;        /* a folder, or NULL */
    const char *continues;      /* what a cancelled run says where the folder holds what it has finished */
} precompute_options;

/* Whether an input is a store: an HDF5 file, or one that is called so. */
bool precompute_takes_as_store(const char *path);

/* What kind of scene it is, looked at thoroughly: its form factors by so many rays as 2^28 allow, from 256 to
 * 4,096 an element, unless their number is given or a store has them; rays_used says how many (0: of a
 * store). Of the options those about the scene, its sky and emitters, epsilon, threshold, memory, seed count.
 */
lam_status precompute_classify(const precompute_options *options, terminal *t, scene_class *out,
                               size_t *rays_used, lam_error *error);

/* Does it all; on an error nothing is written. report says what was built. */
lam_status precompute_run(const precompute_options *options, terminal *t, build_report *report,
                          lam_error *error);

/* A seed that belongs to seed but shares no stream with it; another one for every purpose from 1. */
uint64_t precompute_seed(uint64_t seed, uint64_t purpose);

#endif
