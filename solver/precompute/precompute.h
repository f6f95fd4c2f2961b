/* From a scene (or a store with form factors) to a sealed store: the stages in their order. */
#ifndef LAMBERT_PRECOMPUTE_PRECOMPUTE_H
#define LAMBERT_PRECOMPUTE_PRECOMPUTE_H

#include "solver/base/options/options.h"
#include "solver/base/terminal.h"
#include "solver/formfactor/source.h"
#include "solver/method/choice.h"
#include "solver/precompute/error_advice.h"
#include "solver/precompute/forecast/forecast.h"
#include "solver/scene/mesh.h"

/* --two-sided: materials say which faces have a back; every face has one; none has. */
typedef enum sides_asked { SIDES_OF_MATERIALS, SIDES_BOTH, SIDES_FRONTS } sides_asked;

/* --mesh: faces are divided until they fit the light, or not at all. */
typedef enum mesh_asked { MESH_OF_LIGHT, MESH_OF_FACES } mesh_asked;

/* --quality: the place among the words of its row (option_word). */
typedef enum factor_quality { QUALITY_DRAFT, QUALITY_NORMAL, QUALITY_HIGH } factor_quality;
extern const char precompute_quality_words[];

/* The light that panes pass: less of it aslant, or the same from every side. */
typedef enum glass_law { GLASS_BY_ANGLE, GLASS_EVENLY } glass_law;

/* --luminaires and --sensors: the words for leaving those of a store out. */
#define LUMINAIRES_NONE "none"

#define SENSORS_NONE "none"

/* The word of --sources for all that luminaires light, and that of --receivers for all that sensors see. */
#define SOURCES_LUMINAIRES "luminaires"
#define RECEIVERS_SENSORS "sensors"

/* The options, as the rows of precompute_tables_make fill them; texts point into argv. The members after
 * progress belong to the verb. */
typedef struct precompute_options {
    const char *output;
    uint64_t elements;
    double max_edge, reflectance; /* reflectance: negative, the file's own */
    double unit;                  /* metres; 0: not given, 1 */
    double mesh_error;            /* 0: as mesh says, or by size */
    mesh_asked mesh;              /* where no other option of the mesh is given */
    const char *up;               /* NULL: by the file */
    const char *assets;           /* a folder, or NULL */
    const char *format;           /* NULL: by the extension of the input */
    const char *lights;           /* W or lm; NULL: by the file, or that of the store */
    bool orient, fix;
    sides_asked two_sided;
    scene_closure closed;
    unsigned form_factors; /* --form-factors: source_asked */
    factor_quality quality;
    uint64_t rays, resolution; /* rays: OPTION_AUTO */
    const char *sky;           /* a tiling, or NULL; from a store: that of the store */
    double ground_albedo;
    double north;        /* degrees; NAN: 0, or that of the store */
    option_list portals; /* names of groups */
    option_list glass;   /* GROUP=T[,FACES] */
    glass_law glass_law;
    bool keep_form_factors;
    const char *luminaires, *sensors;   /* FILE, LUMINAIRES_NONE, SENSORS_NONE; or NULL */
    double probes_grid;                 /* m, the spacing of a set of probes; 0: none */
    bool probes_y_up;                   /* their axes */
    const char *emitters;               /* FILE, group=NAME, sky; or NULL */
    const char *receivers, *importance; /* NAME,NAME; FILE; one of them, or both NULL */
    const char *sources;                /* NAME,NAME; or NULL */
    build_options build;                /* memory, seed and progress are set when the build begins */
    uint64_t threads, memory;           /* memory: bytes; 0: 70 % of what is free */
    const char *scratch;                /* a folder, or NULL */
    uint64_t seed, probes;              /* probes: OPTION_AUTO */
    double group_error;                 /* of the worst group, to keep; 0: none is asked for */
    uint64_t trials;                    /* of an error that is kept, at most */
    double time;                        /* seconds; 0: no limit */
    bool quiet, progress;
    const char *input;
    bool from_store;
    const char *command;   /* for the record */
    const char *continues; /* the message of a cancelled run whose finished rows the folder holds */
} precompute_options;

/* The tables of options, and the rows of --form-factors and --method, whose words are those of the lists of
 * sources and methods. The tables refer to these rows and words: the struct must stay where it is. */
enum { PRECOMPUTE_TABLES = 10, PRECOMPUTE_TABLES_MOST = PRECOMPUTE_TABLES + METHODS_MOST + 2 };
typedef struct precompute_tables {
    size_t n_tables;                             /* without the last, which has no rows */
    option_table tables[PRECOMPUTE_TABLES_MOST]; /* the methods have one each, and the verb has one */
    option_row source_rows[2], method_rows[2];
    char sources[SOURCE_WORDS_BYTES];
    char methods[METHOD_CHOICES_BYTES];
} precompute_tables;

/* Refuses options of earlier versions with advice on others. */
extern const option_gone precompute_gone[];

/* Makes the tables that fill o, whose fields without presets it sets first. to_classify: only those of the
 * scene and of the choice of a method. */
void precompute_tables_make(precompute_options *o, bool to_classify, precompute_tables *out);

/* Adds a table of the verb's own, once. */
void precompute_tables_add(precompute_tables *t, const option_row *rows, void *fields);

/* True for an option that --positions and --path, which need no form factors, have no use for. */
bool precompute_walks_ignore(const char *name);

/* True for an HDF5 file, or one that is named so: it is taken for a store. */
bool precompute_takes_as_store(const char *path);

/* Weighs all methods for a scene, thoroughly: by form factors of as many rays as 2^28 allow, from 256 to
 * 4,096 per element, unless their number is given or a store has them; *rays_used is that number (0: of a
 * store), *n the number of elements. The caller frees out with decision_free; its problem and options are
 * gone. */
lam_status precompute_classify(const precompute_options *options, terminal *t, decision *out, size_t *n,
                               size_t *rays_used, lam_error *error);

/* Runs all stages; on an error nothing is written. report describes the operator built; unused lists the
 * options among those given that the method built had no use for: "--alpha, --levels"; advice is the line of
 * error_advice.h, which was logged as a warning, or "". */
typedef struct precompute_result {
    build_report report;
    char unused[256];
    char advice[ERROR_ADVICE_BYTES];
    size_t n_faces;                 /* of the file; 0: a store was read */
    forecast_times forecast, spent; /* processor seconds of the stages: the forecast, and the truth */
} precompute_result;
lam_status precompute_run(const precompute_options *options, const option_result *given, terminal *t,
                          precompute_result *result, lam_error *error);

/* The streams of random numbers of a precompute and of verify: a seed is one for each purpose, and shares no
 * stream with the seed that it is made of. The numbers are part of every store: do not change them. A store's
 * own form factors may have been made with the seed of a judge's sample; then the next number is taken. */
typedef enum seed_purpose {
    SEED_JUDGE_FIRST = 1,   /* the judge's first sample of the form factors */
    SEED_JUDGE_SECOND = 2,  /* its second */
    SEED_PROBES = 3,        /* emissions that the error is measured with */
    SEED_PRECISION = 4,     /* emissions that the loss of --store-precision is measured with */
    SEED_FIRST_LIGHT = 5,   /* the judge's direct illumination of single elements */
    SEED_OTHER_ROWS = 6,    /* rows of a stream that a self-check compares with */
    SEED_MESH = 7,          /* the coarse solution of --mesh-error, and its light at points */
    SEED_MESH_ERROR = 8,    /* light at points by which the error of the mesh is stated */
    SEED_POSITIONS = 9,     /* paths of a moving light */
    SEED_LUMINAIRES = 10,   /* segments towards luminaires */
    SEED_VERIFY_FIRST = 11, /* of verify: its samples, probes and direct illumination */
    SEED_VERIFY_SECOND = 12,
    SEED_VERIFY_PROBES = 13,
    SEED_VERIFY_FIRST_LIGHT = 14,
    SEED_VERIFY_WALKS = 15,
    SEED_VERIFY_LUMINAIRES = 16,
    SEED_SENSORS = 17,
    SEED_VERIFY_SENSORS = 18,
    SEED_LINEAR_FIRST = 1, /* emissions that verify adds up: their seeds are counted, not given by a user */
    SEED_LINEAR_SECOND = 2
} seed_purpose;
uint64_t precompute_seed(uint64_t seed, seed_purpose purpose);

#endif
