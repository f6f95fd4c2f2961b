#include "server/route/array_members.h"

#include "server/route/call.h"

#include <string.h>

/* Reads one member of a query. */
static bool read_member(const query_member *m, lam_quantity *quantity, bool *limit, problem *why) {
    if (strcmp(m->name, "quantity") == 0)
        return codec_quantity_find(m->value, strlen(m->value), quantity) ||
               problem_set(why, PROBLEM_UNKNOWN_WORD,
                           "?quantity=%.60s must be radiosity, irradiance or indirect", m->value);
    if (limit == NULL || strcmp(m->name, "limit") != 0)
        return problem_set(why, PROBLEM_WRONG_MEMBERS, "the query has \"%.60s\", may have %s alone", m->name,
                           limit != NULL ? "limit and quantity" : "quantity");
    *limit = strcmp(m->value, "true") == 0;
    return *limit || strcmp(m->value, "false") == 0 ||
           problem_set(why, PROBLEM_UNKNOWN_WORD, "?limit=%.60s must be true or false", m->value);
}

bool array_members_read(const call *in, lam_quantity *quantity, bool *limit, problem *why) {
    if (in->n_query > 0 && in->body_type == MEDIA_JSON)
        return problem_set(why, PROBLEM_WRONG_MEMBERS,
                           "the query has \"%.60s\"; a request in JSON has its members in its body, and none "
                           "in a query",
                           in->query[0].name);
    for (size_t k = 0; k < in->n_query; k++) {
        for (size_t j = 0; j < k; j++)
            if (strcmp(in->query[j].name, in->query[k].name) == 0)
                return problem_set(why, PROBLEM_GIVEN_TWICE, "the query has \"%.60s\" a second time",
                                   in->query[k].name);
        if (!read_member(&in->query[k], quantity, limit, why)) return false;
    }
    return true;
}
