/* The bytes of a request, or of a file of emissions, to emission vectors and options. No I/O, so that it can
 * be fuzzed. Knows nothing of HTTP but the status of a refusal. */
#ifndef LAMBERT_CODEC_REQUEST_H
#define LAMBERT_CODEC_REQUEST_H

#include "lambert/lambert.h"
#include "solver/base/photometry.h"
#include "solver/codec/face_means.h"
#include "solver/codec/group_figures.h"
#include "solver/codec/luminaire_names.h"
#include "solver/codec/problem.h"
#include "solver/operator/groups/adjoint_row.h"
#include "solver/operator/groups/groups.h"

/* The scene that a request is about, and the limits of one request. */
typedef struct codec_scene {
    size_t n;
    size_t n_channels;
    light_kind lights;                 /* of emissions and radiances without a unit */
    const group_index *groups;         /* measured, where lights may be given as flux */
    const face_index *faces;           /* of the scene file; NULL or empty: they are not known */
    size_t n_tiles;                    /* of the sky; 0: none */
    size_t n_emitters;                 /* 0: none; the last of them are the luminaires */
    const group_index *emitters;       /* these by name; NULL: they have none */
    size_t n_luminaires;               /* 0: none */
    const luminaire_names *luminaires; /* these by name; not NULL where there are any */
    const double *area;                /* [n], m^2; NULL: no cotangent is of a mean or a sum */
    const group_index *sensors;        /* sets of receivers by name; NULL or empty: none */
    size_t max_batch;                  /* vectors in a request, at most CODEC_BATCH_MOST */
    size_t max_bytes;                  /* of emission vectors in a request */
    /* Asked before memory for emission vectors is allocated, of bytes more than before; false with *why.
     * NULL: max_bytes is the only limit. */
    bool (*take)(void *owner, size_t bytes, problem *why);
    void *owner;      /* of take */
    bool only_linear; /* anything but a linear reduction of sparse vectors is refused (503) before it costs
                         more than its text */
    size_t max_rows;  /* adjoint rows that the scene keeps: at most so many groups are reduced by them */
    bool signs;       /* emissions may be negative: radiosity is linear in them. Skies and weights may not */
    const char *source;     /* the word for the bytes in messages; NULL: "the body" */
    const char *item;       /* the word for one of the n values of an NPY row; NULL: "element" */
    const char *no_sun;     /* why a sun is not answered; NULL: it is */
    const char *no_sensors; /* why sensors have no values; NULL: they have */
    bool frames;            /* an array of two axes is always a batch, of vectors that all channels share */
} codec_scene;

#define CODEC_BATCH_MOST ((size_t)UINT32_MAX)

/* The word for the bytes in messages. */
const char *codec_source(const codec_scene *scene);

/* Radiances, weights or dimmers beside the emissions: [n][C][width], for the first n vectors. */
typedef struct side_rows {
    float *values; /* NULL: no vector has any */
    size_t n, capacity;
} side_rows;

/* The sun over a vector, which has one at most. */
typedef struct request_sun {
    uint32_t vector;
    double azimuth, altitude; /* degrees */
    double north;             /* of the model, degrees; NAN: the store's own */
} request_sun;

/* Starts zeroed. */
typedef struct radiosity_request {
    size_t n_rhs;
    bool batch;           /* the answer is one level deeper, also for one vector */
    bool any_sign;        /* values may be negative: a cotangent */
    float *E;             /* [n_rhs][C][n], mesh order; NULL: the spots are all there is */
    emission_spot *spots; /* of sparse vectors that are not in E yet, ascending by vector */
    float *colours;       /* [n_spots][C] */
    size_t n_spots;
    bool select; /* only these elements, in this order */
    uint32_t *selected;
    size_t n_selected;
    bool at_faces;   /* the answer is of faces, with select of some, of which `selected` has the elements */
    uint32_t *faces; /* [n_faces], these; NULL: all */
    size_t n_faces;
    bool at_corners;  /* the answer is of the corners that elements share, without select and reduce */
    size_t n_corners; /* of these, set by the caller once it knows them */
    /* Numbers or figures of receivers, which have irradiance: `quantity` is what is gathered from, radiosity,
     * and `select` is off. */
    bool at_sensors;
    bool at_probes;      /* they are probes, of which each has nine numbers: coefficients of radiance */
    uint32_t *receivers; /* [n_receivers], those selected, of the sets that reduce names; NULL with reduce */
    size_t n_receivers;
    lam_quantity quantity;
    light_conversion told; /* of the answer; once read, the light above is in its unit */
    bool linear_map;       /* "limit": false: light below zero stays */
    double tolerance;      /* of a refined answer, above 0 and below 1; 0: none is asked for */

    reduce_request reduce; /* figures of groups in place of vectors */
    side_rows sky;         /* radiances of its tiles */
    bool by_luminance;     /* some are the luminance of a colour, for a store of one channel */
    side_rows emitters;    /* their weights */
    side_rows luminaires;  /* their dimmers */
    side_rows sensors;     /* of a cotangent, of their values */
    side_rows seen_sky;    /* at sensors: `sky` with the radiances that weights of emitters stand for; the
                              reader leaves it empty */
    request_sun *suns;     /* [n_suns], by growing vector */
    float *sunlight;       /* [n_suns][C], irradiance of a plane normal to them */
    size_t n_suns, suns_capacity;

    size_t n_dense, dense_capacity; /* vectors that E holds, and has room for */
    size_t spots_capacity;
} radiosity_request;

void radiosity_request_free(radiosity_request *request);

/* All three return false with *why filled; request must be freed either way.
 * text[length] must be NUL. 400: not JSON, or not NPY; 422: what the contract lists.
 * E then holds every vector, but for a linear reduction of sparse vectors, which stay spots, so that reading
 * it costs no more than the text is long; that of sensors is linear where sparse vectors are of whole groups.
 * For any other reduction of groups, select names their elements. */
bool codec_read_json(const codec_scene *scene, const char *text, size_t length, radiosity_request *request,
                     problem *why);

/* A JSON file of emissions: an EMISSION of the contract, or an object with one as `emission`, or with a batch
 * of them as `emissions`. E then holds every vector. */
bool codec_read_emissions(const codec_scene *scene, const char *text, size_t length,
                          radiosity_request *request, problem *why);

/* NPY format 1.0 to 3.0, little-endian <f4 or <f8, C or Fortran order. For one channel [n], or a batch [m][n]
 * or [m][1][n]; for more channels [n] (all alike), [C][n], or a batch [m][C][n]. */
bool codec_read_npy(const codec_scene *scene, const char *bytes, size_t length, radiosity_request *request,
                    problem *why);

/* The first spot of the vectors from this one on; n_spots where these have none. O(log spots). */
size_t radiosity_request_spots(const radiosity_request *request, size_t vector);

/* True where a channel of a vector has an emission, a radiance, a weight or a dimmer below 0. n and C are of
 * the scene.
 */
bool radiosity_request_has_signs(const radiosity_request *request, const codec_scene *scene, size_t vector,
                                 size_t c);

/* Adds a vector without any emission. */
bool radiosity_request_add(radiosity_request *request, const codec_scene *scene, problem *why);

/* Room in E for the last vector, zeroed: *E is its [C][n]; so is that of those before it that have none. */
bool radiosity_request_dense(radiosity_request *request, const codec_scene *scene, float **E, problem *why);

/* Makes the spot that was added last one of a mean, over groups of this area together, or with 1 of a sum. */
void radiosity_request_share(radiosity_request *request, double area);

/* A spot of the last vector; colour is [C]. */
bool radiosity_request_spot(radiosity_request *request, const codec_scene *scene, uint32_t where,
                            bool whole_group, const float *colour, problem *why);

/* Puts every vector into E, the spots with it. */
bool radiosity_request_expand(radiosity_request *request, const codec_scene *scene, problem *why);

/* The sky over the last vector, or the weights of its emitters, or the dimmers of its luminaires, zeroed:
 * *row is its [C][m], [C][s] or [C][k]; so are those of the vectors before it that have none. */
bool radiosity_request_sky(radiosity_request *request, const codec_scene *scene, float **row, problem *why);
bool radiosity_request_emitters(radiosity_request *request, const codec_scene *scene, float **row,
                                problem *why);
bool radiosity_request_luminaires(radiosity_request *request, const codec_scene *scene, float **row,
                                  problem *why);

/* The same of the cotangent of sensors, [C][receivers]. */
bool radiosity_request_sensors(radiosity_request *request, const codec_scene *scene, float **row,
                               problem *why);

/* A sun over the last vector, which is set here; direct is [C]. */
bool radiosity_request_sun(radiosity_request *request, const codec_scene *scene, const request_sun *sun,
                           const float *direct, problem *why);

/* The faces of an answer of faces, and the numbers of an answer to one vector in one channel. */
face_choice radiosity_request_faces(const radiosity_request *request, const face_index *faces);
size_t radiosity_request_values(const radiosity_request *request, size_t n, const face_index *faces);

/* The quantity of the numbers of the answer. */
static inline lam_quantity radiosity_request_told(const radiosity_request *request) {
    return request->at_sensors ? LAM_IRRADIANCE : request->quantity;
}

/* Channels of the answer, of C of the scene: 1 where it is of their luminance. */
static inline size_t radiosity_request_channels(const radiosity_request *request, size_t n_channels) {
    return request->told.luminance ? 1 : n_channels;
}

/* The contract's word for a quantity, and the quantity of a word: false for any other word. */
const char *codec_quantity_name(lam_quantity quantity);
bool codec_quantity_find(const char *word, size_t length, lam_quantity *quantity);

#endif
