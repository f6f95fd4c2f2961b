/* Members of a request whose body is an array, which has no place for them: they stand in its query. */
#ifndef LAMBERT_SERVER_ROUTE_ARRAY_MEMBERS_H
#define LAMBERT_SERVER_ROUTE_ARRAY_MEMBERS_H

#include "lambert/lambert.h"

#include <stdbool.h>

typedef struct call call;
typedef struct problem problem;

/* Reads ?quantity=NAME, and where limit is not NULL ?limit=true or false, and leaves those that are not
 * given. Others are refused by name (422), and all beside a body in JSON, which has members of its own. */
bool array_members_read(const call *in, lam_quantity *quantity, bool *limit, problem *why);

#endif
