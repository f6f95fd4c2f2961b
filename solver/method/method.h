/* From form factors to an operator. A method is a const table at the end of its own file; methods.c lists
 * them. The table holds the method's options, needs, forecast, cost and build: nothing else knows a method by
 * name. */
#ifndef LAMBERT_METHOD_METHOD_H
#define LAMBERT_METHOD_METHOD_H

#include "solver/base/options/options.h"
#include "solver/base/progress.h"
#include "solver/linalg/csr.h"
#include "solver/linalg/row_source.h"
#include "solver/method/report.h"
#include "solver/operator/blocks/block_factors.h"
#include "solver/operator/blocks/importance.h"
#include "solver/operator/operator.h"

/* The emitters that alone are going to shine: numbers of emitter k come k C at a time. */
typedef struct emitter_source {
    size_t s;
    const char *const *names;  /* [s] */
    const float *E;            /* [s][C][n], W/m^2, mesh order */
    size_t n_tiles;            /* of the sky; 0: none */
    const float *L;            /* [s][C][m], radiances of its tiles; NULL: no emitter is of the sky */
    const float *first_bounce; /* [m][n], sr */
    /* Luminaires, which are emitters behind these. */
    size_t n_luminaires;
    const char *const *luminaires; /* [n_luminaires], names */
    const float *H;                /* [n_luminaires][n], lx at dimmer 1 */
    const double *factors;         /* [C][n_luminaires], their colours */
} emitter_source;

/* All emitters, luminaires with them. */
static inline size_t emitter_source_count(const emitter_source *from) {
    return from->s + from->n_luminaires;
}

/* The input of every method. All in mesh order; order[position] = element is the Z-order. */
typedef struct build_problem {
    size_t n;
    size_t n_channels;
    const double *area;          /* [n] */
    const float *reflectance;    /* [C][n], in [0, 1) */
    const csr *F;                /* NULL where there are others, and before the form factors are found */
    row_stream *stream;          /* of rows of F, in place of F; METHOD_STREAMS */
    const block_factors *blocks; /* in place of F, on a tree with leaves of PLANE_LEAF; METHOD_BLOCKS */
    const uint32_t *order;       /* [n] */
    const uint32_t *group;       /* [n] below n_groups, whose light is asked for; NULL: not known */
    size_t n_groups;
    double noise; /* sampling error of S in the 2-norm, about; 0: not known */
    /* NULL where no method needs them: METHOD_GEOMETRY. */
    const double (*centre)[3];      /* [n] centroids, m */
    const float (*normal)[3];       /* [n] unit */
    const uint32_t *surface;        /* [n] below n: equal where elements lie on one surface */
    const element_corners *corners; /* of the tree of clusters; NULL: it does without */
    const emitter_source *emitters; /* NULL: none asked for */
    const importance *importance;   /* of what is read, found; NULL: all is read */
} build_problem;

/* Methods at most, and bytes of the options of one. */
enum { METHODS_MOST = 16, METHOD_OPTIONS_BYTES = 96 };

typedef union method_values {
    unsigned char bytes[METHOD_OPTIONS_BYTES];
    double align;
} method_values;

/* The options of a build. build_rows and the rows of every method fill it; build_presets does without a
 * command line. */
typedef struct build_options {
    const char *method;    /* "auto" or the name of a method */
    double epsilon;        /* the error at which auto compares methods */
    const char *precision; /* of the large arrays of the operator: "f32", "f16", "i8" */
    size_t memory;         /* bytes it may use; 0: no limit */
    uint64_t seed;         /* of random sketches */
    const progress *progress;
    method_values of[METHODS_MOST]; /* each method's own, in the order of the list */
} build_options;

/* Bytes that a build is going to take beside the form factors. */
typedef struct method_forecast {
    double building; /* at the peak, while the operator is made */
    double loaded;   /* by the operator in memory, in single precision where its kind can be narrowed */
    double stored;   /* by its arrays in the store, likewise */
    double seconds;  /* of a processor, while it is made; 0: not known */
    double answer;   /* seconds of a processor for an answer of one channel, among many; 0: not known */
} method_forecast;

/* The size of a build, as far as it is known before. */
typedef struct method_scale {
    double n, n_channels;
    double n_own_channels; /* of these, those whose reflectances no earlier one has; 0: all */
    double noise;          /* of S, 2-norm; 0: none */
    double n_emitters;     /* 0: none, or not read yet */
    double n_blocks;       /* of form factors; 0: they are rows */
    double entries;        /* of the rows; 0: not known */
    double n_planes;       /* of the tree of clusters; 0: not known */
    double hits;           /* share of the rays from elements that hit anything; 0: not known */
} method_scale;

struct decision;
struct candidate;

/* A method needs, or can do without, these of a problem. */
enum {
    METHOD_GEOMETRY = 1,      /* it needs centres and normals */
    METHOD_STREAMS = 2,       /* it can build from a stream of rows instead of F */
    METHOD_FILTERS_NOISE = 4, /* it leaves out most of the noise of rays, so fewer rays are enough */
    METHOD_BLOCKS = 8,        /* it can build from blocks of form factors instead of F */
    METHOD_KEEPS_EPSILON =
        16,               /* its epsilon is an error of answers, which trials keep where it is measured */
    METHOD_SURFACES = 32, /* it needs surfaces beside centres and normals */
    METHOD_READS = 64,    /* it uses the importance of what is read */
};

/* One method. own points to a struct of the method that its rows fill; a NULL function has no effect.
 * Units of cost: coefficients of a dense matrix that one answer reads, per channel (choice.h). */
typedef struct build_method {
    const char *name;          /* the word of --method */
    const char *summary;       /* one line of --help */
    const operator_kind *kind; /* of the operator that it usually makes */
    const option_row *rows;    /* its options, with presets and limits; NULL: none */
    unsigned flags;            /* METHOD_... */
    const char *smaller;       /* an option that asks for a smaller operator; NULL: none is known */
    /* Checks a command line: LAM_ERR_ARGUMENT where options that are each in their limits do not go
     * together. */
    lam_status (*check)(const void *own, lam_error *error);
    /* True if an option that was given, a row of this table, had no effect beside the others. */
    bool (*ignores)(const void *own, const build_report *report, const char *option);
    void (*forecast)(const method_scale *scale, const void *own, method_forecast *out);
    /* True if options are set that only this method has a use for, so that auto leaves out its rivals. */
    bool (*is_asked)(const struct build_options *options, const void *own);
    /* The method's part in the choice of --method auto (choice.h); NULL: auto never takes it. */
    lam_status (*weigh)(const struct decision *so_far, void *own, struct candidate *out, lam_error *error);
    /* METHOD_BLOCKS: the bound of the error of one block (recipe.accuracy) that suits the operator. */
    double (*block_accuracy)(const void *own);
    /* Fills op (closed by the caller) and report. Errors: LAM_ERR_NUMERIC, _MEMORY, _CANCELLED, _ARGUMENT. */
    lam_status (*build)(const build_problem *problem, const build_options *options, const void *own,
                        lam_operator **op, build_report *report, lam_error *error);
} build_method;

/* The list: the k-th method, NULL beyond the last; the method of a name, or NULL. */
const build_method *method_at(size_t k);
const build_method *method_find(const char *name);

/* Fills words with the values of --method: "auto|exact|...". */
enum { METHOD_CHOICES_BYTES = 16 * (METHODS_MOST + 1) };
void method_choices(char words[METHOD_CHOICES_BYTES]);

/* The method that auto takes where no other can be had; it takes little memory at any size. */
const build_method *method_fallback(void);

/* True if an option has a row in the table of the method; NULL: of any method. */
bool method_has_option(const build_method *method, const char *option);

/* The factorizers of low-rank and 2msc, which share the option. */
#define METHOD_FACTORIZERS "auto|hf|svd|rsi|sgrsvd|qr"

/* The own options of a method among those of a build. */
void *method_own(build_options *options, const build_method *method);
const void *method_own_const(const build_options *options, const build_method *method);

/* Rows of epsilon and store-precision, for a table with a build_options. */
extern const option_row build_rows[];

/* All options of all methods at their presets. */
build_options build_presets(const char *method);

/* Gives an option a value as a command line would: every method that has it gets it. Errors: LAM_ERR_ARGUMENT
 * names the option where no method has it or the value is outside its limits. */
lam_status build_set(build_options *options, const char *name, const char *value, lam_error *error);
lam_status build_set_number(build_options *options, const char *name, double value, lam_error *error);

/* Builds by one method. Errors: also LAM_ERR_ARGUMENT for options outside their limits and for a problem that
 * lacks what the method needs. */
lam_status method_build(const build_method *method, const build_problem *problem,
                        const build_options *options, const void *own, lam_operator **op,
                        build_report *report, lam_error *error);

/* Builds by options->method; "auto" chooses by choose_method. */
lam_status build_operator(const build_problem *problem, const build_options *options, lam_operator **op,
                          build_report *report, lam_error *error);

#endif
