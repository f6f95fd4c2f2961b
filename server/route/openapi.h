/* server/route/openapi.json, which CMake turns into an array. */
#ifndef LAMBERT_SERVER_ROUTE_OPENAPI_H
#define LAMBERT_SERVER_ROUTE_OPENAPI_H

#include <stddef.h>

extern const unsigned char openapi_bytes[];
extern const size_t openapi_length;

#endif
