/* Embree's queries in one form for its versions 3 and 4, which know a query by a context and by arguments;
 * the build says which one is there (LAMBERT_EMBREE). */
#ifndef LAMBERT_FORMFACTOR_VISIBILITY_EMBREE_H
#define LAMBERT_FORMFACTOR_VISIBILITY_EMBREE_H

#if LAMBERT_EMBREE == 4
#include <embree4/rtcore.h>

typedef struct RTCRayQueryContext embree_context;
enum { EMBREE_FILTERS_QUERIES = RTC_SCENE_FLAG_FILTER_FUNCTION_IN_ARGUMENTS };
#else
#include <embree3/rtcore.h>

typedef struct RTCIntersectContext embree_context;
enum { EMBREE_FILTERS_QUERIES = RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION };
#endif

#include <stdbool.h>

/* A query of packets of eight. Where `filter` is set it gets a pointer to `context`, the first member, so
 * that a struct that begins with a query can hold the data of its filter; the scene needs the flag
 * EMBREE_FILTERS_QUERIES. `coherent` is for rays that lie close together. */
typedef struct embree_query {
    embree_context context;
    RTCFilterFunctionN filter;
    bool coherent;
} embree_query;

/* A query without a filter, of rays that go anywhere. */
static inline void embree_query_init(embree_query *query) {
#if LAMBERT_EMBREE == 4
    rtcInitRayQueryContext(&query->context);
#else
    rtcInitIntersectContext(&query->context);
#endif
    query->filter = NULL;
    query->coherent = false;
}

#if LAMBERT_EMBREE == 4
static inline enum RTCRayQueryFlags embree_query_flags(const embree_query *query) {
    return (query->filter != NULL ? RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER : RTC_RAY_QUERY_FLAG_NONE) |
           (query->coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT);
}
#else
static inline void embree_query_set(embree_query *query) {
    query->context.filter = query->filter;
    query->context.flags =
        query->coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
}
#endif

/* The first hits of the rays whose lanes are active (-1). */
static inline void embree_intersect(const int active[8], RTCScene scene, embree_query *query,
                                    struct RTCRayHit8 *rays) {
#if LAMBERT_EMBREE == 4
    struct RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    arguments.flags = embree_query_flags(query);
    arguments.context = &query->context;
    arguments.filter = query->filter;
    rtcIntersect8(active, scene, rays, &arguments);
#else
    embree_query_set(query);
    rtcIntersect8(active, scene, &query->context, rays);
#endif
}

/* Sets tfar of the active rays that meet anything to minus infinity. */
static inline void embree_occluded(const int active[8], RTCScene scene, embree_query *query,
                                   struct RTCRay8 *rays) {
#if LAMBERT_EMBREE == 4
    struct RTCOccludedArguments arguments;
    rtcInitOccludedArguments(&arguments);
    arguments.flags = embree_query_flags(query);
    arguments.context = &query->context;
    arguments.filter = query->filter;
    rtcOccluded8(active, scene, rays, &arguments);
#else
    embree_query_set(query);
    rtcOccluded8(active, scene, &query->context, rays);
#endif
}

#endif
