/* A forecast of what finding form factors by a recipe takes, from a sample of its work. */
#ifndef LAMBERT_FORMFACTOR_FACTOR_COST_H
#define LAMBERT_FORMFACTOR_FACTOR_COST_H

typedef struct factor_cost {
    double seconds;  /* of one thread, by fixed costs of each kind of work: for a choice */
    double measured; /* the same at the pace of the sample on this machine: for a forecast */
    double segments; /* of pairs: of measured, those of segments */
    double entries;  /* of F, or twice the blocks */
    double finer;    /* of blocks: measured, of those that judge them; else 0 */
    double hits;     /* of rays: the share that hits anything; 0: not known */
} factor_cost;

/* Seconds of an entry of the triangle, by whatever it was found. */
extern const double factor_entry_seconds;

/* The processor seconds of a sample over those that fixed costs let expect: the pace of this machine in this
 * scene, from 1/8 to 8; 1 where the sample was too short to tell. */
double factor_cost_pace(double seconds, double expected);

#endif
