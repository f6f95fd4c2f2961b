/* An element chooses up to PORTAL_GROUPS groups of portals by halving, and shares 3/4 of its rays by their
 * weights, about strength A cos cos' / (pi r^2 + A), and 1/4 evenly. portals_point() draws points by these
 * shares, and portals_density() returns their density q(w) = sum_k share_g r^2 / (A_g cos_k). */
#include "solver/formfactor/rays/portal_aim.h"

#include "solver/base/vector3.h"
#include "solver/scene/plane.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

portal portal_of(const plane_patch *patch, const double centre[3]) {
    portal p = {.triangle = patch->triangle, .opening = patch->opening};
    for (int d = 0; d < 3; d++) {
        p.corner[d] = patch->corner[d] - centre[d];
        for (int k = 0; k < 2; k++) p.edge[k][d] = patch->edge[k][d];
    }
    const double *a = p.edge[0], *b = p.edge[1];
    const double cross[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    const double whole = sqrt(dot3(cross, cross)), aa = dot3(a, a), ab = dot3(a, b), bb = dot3(b, b);
    p.area = p.triangle ? whole / 2 : whole;
    for (int d = 0; d < 3; d++) {
        p.normal[d] = cross[d] / whole;
        p.inverse[0][d] = (bb * a[d] - ab * b[d]) / (aa * bb - ab * ab);
        p.inverse[1][d] = (aa * b[d] - ab * a[d]) / (aa * bb - ab * ab);
    }
    return p;
}

static size_t corners_of(const portal *p) {
    return p->triangle ? 3 : 4;
}

static void corner_of(const portal *p, size_t k, double at[3]) {
    for (int d = 0; d < 3; d++)
        at[d] = p->corner[d] + (double)(k & 1) * p->edge[0][d] + (double)(k >> 1) * p->edge[1][d];
}

static void middle_of(const portal *p, double at[3]) {
    const double part = p->triangle ? 1. / 3 : 1. / 2;
    for (int d = 0; d < 3; d++) at[d] = p->corner[d] + part * (p->edge[0][d] + p->edge[1][d]);
}

typedef struct keyed {
    double key;
    portal portal;
} keyed;

static int by_key(const void *a, const void *b) {
    const keyed *p = a, *q = b;
    if (p->key != q->key) return p->key < q->key ? -1 : 1;
    return memcmp(&p->portal, &q->portal, sizeof p->portal);
}

static void bound(const portals *p, portal_node *node) {
    for (int d = 0; d < 3; d++) {
        node->low[d] = INFINITY;
        node->high[d] = -INFINITY;
    }
    for (uint32_t k = node->first; k < node->first + node->count; k++) {
        const portal *one = &p->portal[k];
        node->power += one->area * fmax(one->strength[0], one->strength[1]);
        for (size_t c = 0; c < corners_of(one); c++) {
            double at[3];
            corner_of(one, c, at);
            for (int d = 0; d < 3; d++) {
                node->low[d] = fmin(node->low[d], at[d]);
                node->high[d] = fmax(node->high[d], at[d]);
            }
        }
    }
}

/* The node of count portals and those below it, halved along the longest side; returns the next free node. */
static uint32_t divide(portals *p, keyed *sorted, uint32_t self, uint32_t first, uint32_t count) {
    portal_node *node = &p->node[self];
    *node = (portal_node){.first = first, .count = count};
    bound(p, node);
    if (count == 1) return self + 1;
    int axis = 0;
    for (int d = 1; d < 3; d++)
        if (node->high[d] - node->low[d] > node->high[axis] - node->low[axis]) axis = d;
    for (uint32_t k = 0; k < count; k++) {
        double middle[3];
        middle_of(&p->portal[first + k], middle);
        sorted[k] = (keyed){middle[axis], p->portal[first + k]};
    }
    qsort(sorted, count, sizeof *sorted, by_key);
    for (uint32_t k = 0; k < count; k++) p->portal[first + k] = sorted[k].portal;
    node->second = divide(p, sorted, self + 1, first, count / 2);
    return divide(p, sorted, node->second, first + count / 2, count - count / 2);
}

lam_status portals_build(portal *array, size_t n, portals *out, lam_error *error) {
    lam_status status = LAM_OK;
    portals p = {.n = n, .portal = array};
    keyed *sorted = memory_allocate(n + 1, sizeof *sorted, "portals", error);
    p.before = memory_allocate(n + 1, sizeof *p.before, "portals", error);
    p.node = memory_allocate(2 * n + 1, sizeof *p.node, "portals", error);
    if (sorted == NULL || p.before == NULL || p.node == NULL) TRY(LAM_ERR_MEMORY);
    if (n > 0) (void)divide(&p, sorted, 0, 0, (uint32_t)n);
    for (size_t k = 0; k < n; k++) p.before[k + 1] = p.before[k] + array[k].area;
    for (int d = 0; d < 3 && n > 0; d++)
        p.margin = fmax(p.margin, 1e-4 * (p.node[0].high[d] - p.node[0].low[d]));
    *out = p;
    p = (portals){.n = 0};
done:
    free(sorted);
    portals_free(&p);
    return status;
}

void portals_free(portals *p) {
    free(p->portal);
    free(p->before);
    free(p->node);
    *p = (portals){.n = 0};
}

/* An element, or a point, as it aims. */
typedef struct aiming {
    double centre[3], normal[3], radius;
    bool all_round; /* it receives light from all sides, alike, and has no normal */
} aiming;

/* 0 where a point is in the plane of the element, as far as that is plane. */
static double cosine_to(const aiming *from, const double at[3]) {
    double r[3];
    if (from->all_round) return 1;
    for (int d = 0; d < 3; d++) r[d] = at[d] - from->centre[d];
    const double length = sqrt(dot3(r, r));
    return dot3(r, from->normal) > plane_flatness * length ? dot3(r, from->normal) / length : 0;
}

/* A group while it is chosen: a node of the tree, or a part of its only portal. */
typedef struct choice {
    const portal_node *node;
    double from[2], to[2];
    double weight;
    bool divisible;
} choice;

static void point_of(const portal *p, double x, double y, double at[3]) {
    for (int d = 0; d < 3; d++) at[d] = p->corner[d] + x * p->edge[0][d] + y * p->edge[1][d];
}

static double part_of(const choice *c) {
    return (c->to[0] - c->from[0]) * (c->to[1] - c->from[1]);
}

static void middle_of_part(const portal *p, const choice *c, double at[3]) {
    if (p->triangle)
        middle_of(p, at);
    else
        point_of(p, .5 * (c->from[0] + c->to[0]), .5 * (c->from[1] + c->to[1]), at);
}

/* About what an element gets through a part of a portal: its form factor as if it were a disk, by the
 * greatest cosine at the element, times its strength. */
static double weight_of_part(const aiming *from, const portal *p, const choice *c) {
    static const double grazing = .05;
    const double area = p->area * part_of(c);
    double middle[3], r[3], cosine = 0;
    for (size_t k = 0; k < corners_of(p); k++) {
        double at[3];
        point_of(p, k & 1 ? c->to[0] : c->from[0], k >> 1 ? c->to[1] : c->from[1], at);
        cosine = fmax(cosine, cosine_to(from, at));
    }
    if (cosine == 0) return 0;
    middle_of_part(p, c, middle);
    for (int d = 0; d < 3; d++) r[d] = from->centre[d] - middle[d];
    const double square = dot3(r, r), height = dot3(r, p->normal);
    const double strength = fabs(height) < from->radius ? fmax(p->strength[0], p->strength[1])
                            : height > 0                ? p->strength[0]
                                                        : p->strength[1];
    const double slope = fmax(fabs(height) / sqrt(fmax(square, 1e-300)), grazing);
    return strength * area * fmax(cosine, grazing) * slope / (M_PI * square + area);
}

/* Half the diagonal of a group, and the distance of its middle. */
static double size_of(const portals *p, const aiming *from, const choice *c, double *distance) {
    double half = 0, away = 0, middle[3], size[3];
    if (c->node->count == 1) {
        const portal *one = &p->portal[c->node->first];
        middle_of_part(one, c, middle);
        for (int d = 0; d < 3; d++)
            size[d] = fabs((c->to[0] - c->from[0]) * one->edge[0][d]) +
                      fabs((c->to[1] - c->from[1]) * one->edge[1][d]);
    }
    for (int d = 0; d < 3; d++) {
        const double low = c->node->low[d], high = c->node->high[d];
        const double r = (c->node->count == 1 ? middle[d] : .5 * (low + high)) - from->centre[d],
                     h = .5 * (c->node->count == 1 ? size[d] : high - low);
        half += h * h;
        away += r * r;
    }
    *distance = sqrt(away);
    return sqrt(half);
}

/* The weight of several portals is an upper bound of about the same kind. */
static double weight_of(const portals *p, const aiming *from, const choice *c) {
    const portal_node *n = c->node;
    double distance, farthest = -INFINITY;
    if (n->count == 1) return weight_of_part(from, &p->portal[n->first], c);
    for (int corner = 0; corner < 8; corner++) {
        double height = 0;
        for (int d = 0; d < 3; d++)
            height += ((corner >> d & 1 ? n->high[d] : n->low[d]) - from->centre[d]) * from->normal[d];
        farthest = fmax(farthest, height);
    }
    if (!(farthest > 0 || from->all_round)) return 0;
    const double size = size_of(p, from, c, &distance), least = fmax(distance, size);
    return n->power / (M_PI * least * least);
}

/* Groups that are at least as many half diagonals away are even enough: of portals, and of parts of one. */
static const double far_portals = 8, far_parts = 2;

static bool is_divisible(const portals *p, const aiming *from, const choice *c) {
    double distance;
    const bool one = c->node->count == 1;
    const double size = size_of(p, from, c, &distance);
    if (one && p->portal[c->node->first].triangle) return false;
    return size * (one ? far_parts : far_portals) > distance;
}

static void weigh(const portals *p, const aiming *from, choice *c) {
    c->weight = weight_of(p, from, c);
    c->divisible = is_divisible(p, from, c);
}

/* The group that is worth halving most; n where none is. */
static size_t widest(size_t n, const choice *of) {
    size_t best = n;
    for (size_t g = 0; g < n; g++)
        if ((best == n || of[g].weight > of[best].weight) && of[g].divisible) best = g;
    return best;
}

static void halve(const portals *p, const choice *whole, choice half[2]) {
    half[0] = half[1] = *whole;
    if (whole->node->count > 1) {
        half[0].node = whole->node + 1;
        half[1].node = &p->node[whole->node->second];
        return;
    }
    const portal *one = &p->portal[whole->node->first];
    double length[2];
    for (int k = 0; k < 2; k++)
        length[k] = (whole->to[k] - whole->from[k]) * sqrt(dot3(one->edge[k], one->edge[k]));
    const int along = length[1] > length[0];
    half[0].to[along] = half[1].from[along] = .5 * (whole->from[along] + whole->to[along]);
}

/* The part of the rays that all nodes share alike, and parts by their areas: what stands before an opening is
 * not known. */
static const double even_share = .25;

static void share_rays(const portals *p, size_t n, const choice *of, portal_aim *out) {
    double sum = 0, nodes = 0;
    for (size_t g = 0; g < n; g++) {
        sum += of[g].weight;
        nodes += part_of(&of[g]);
    }
    out->n = n;
    for (size_t g = 0; g < n; g++) {
        const portal_node *node = of[g].node;
        const double area = p->before[node->first + node->count] - p->before[node->first];
        out->group[g] = (portal_group){.first = node->first,
                                       .count = node->count,
                                       .from = {of[g].from[0], of[g].from[1]},
                                       .to = {of[g].to[0], of[g].to[1]},
                                       .share = n == 1 ? 1
                                                       : (1 - even_share) * of[g].weight / sum +
                                                             even_share * part_of(&of[g]) / nodes,
                                       .area = area * part_of(&of[g])};
    }
}

void portal_aim_weigh(portal_aim *aim, const double *open) {
    /* Where no ray got through, some light still may: as by one of twice as many. */
    static const double least = 1. / (2 * VISIBILITY_PACKET);
    double sum = 0;
    for (size_t g = 0; g < aim->n; g++) sum += aim->group[g].share * sqrt(fmax(open[g], least));
    for (size_t g = 0; g < aim->n; g++) aim->group[g].share *= sqrt(fmax(open[g], least)) / sum;
}

portal_aim portals_all(const portals *p) {
    return (portal_aim){
        .n = p->n > 0,
        .group = {{.count = (uint32_t)p->n, .to = {1, 1}, .share = 1, .area = p->before[p->n]}}};
}

static void aim_from(const portals *p, const aiming *from, portal_aim *out) {
    choice of[PORTAL_GROUPS];
    size_t n = 0;
    if (p->n > 0) {
        of[0] = (choice){.node = p->node, .to = {1, 1}};
        weigh(p, from, &of[0]);
        n = of[0].weight > 0;
    }
    for (size_t g; n < PORTAL_GROUPS && (g = widest(n, of)) < n;) {
        choice half[2];
        halve(p, &of[g], half);
        of[g] = of[--n];
        for (int h = 0; h < 2; h++) {
            weigh(p, from, &half[h]);
            if (half[h].weight > 0) of[n++] = half[h];
        }
    }
    share_rays(p, n, of, out);
}

void portals_aim(const portals *p, const mesh *m, const visibility *v, size_t element, portal_aim *out) {
    aiming from = {.radius = 0};
    mesh_centroid(m, element, from.centre);
    for (size_t c = 0; c < mesh_corners(m, element); c++) {
        double square = 0;
        for (int d = 0; d < 3; d++) {
            const double r = m->vertices[m->elements[element][c]][d] - from.centre[d];
            square += r * r;
        }
        from.radius = fmax(from.radius, sqrt(square));
    }
    for (int d = 0; d < 3; d++) {
        from.normal[d] = (double)m->normal[element][d];
        from.centre[d] -= visibility_centre(v)[d];
    }
    aim_from(p, &from, out);
}

void portals_aim_at(const portals *p, const double at[3], const double *normal, portal_aim *out) {
    aiming from = {.all_round = normal == NULL};
    for (int d = 0; d < 3; d++) {
        from.centre[d] = at[d];
        from.normal[d] = normal != NULL ? normal[d] : 0;
    }
    aim_from(p, &from, out);
}

void portals_point(const portals *p, const portal_aim *aim, double x, double y, double point[3]) {
    size_t g = 0;
    for (; g + 1 < aim->n && x >= aim->group[g].share; g++) x -= aim->group[g].share;
    const portal_group *group = &aim->group[g];
    if (aim->n > 1) x = fmin(fmax(x / group->share, 0), 1);
    uint32_t low = group->first, high = low + group->count - 1;
    if (low < high) {
        const double from = p->before[low], to = p->before[high + 1], at = from + x * (to - from);
        while (low < high) { /* the last portal with before[low] <= at */
            const uint32_t middle = low + (high - low + 1) / 2;
            if (p->before[middle] <= at)
                low = middle;
            else
                high = middle - 1;
        }
        x = fmin(fmax((at - p->before[low]) / p->portal[low].area, 0), 1);
    }
    if (p->portal[low].triangle && x + y > 1) {
        x = 1 - x;
        y = 1 - y;
    }
    x = group->from[0] + x * (group->to[0] - group->from[0]);
    y = group->from[1] + y * (group->to[1] - group->from[1]);
    point_of(&p->portal[low], x, y, point);
}

/* r^2 / cos of the passage through a portal, at x and y of its edges; 0 where there is none. */
static double passage(const portal *p, const double origin[3], const double direction[3], double *x,
                      double *y) {
    const double along = dot3(direction, p->normal);
    double r[3];
    if (along == 0) return 0;
    for (int d = 0; d < 3; d++) r[d] = p->corner[d] - origin[d];
    const double distance = dot3(r, p->normal) / along;
    if (!(distance > 0)) return 0;
    for (int d = 0; d < 3; d++) r[d] = distance * direction[d] - r[d];
    *x = dot3(r, p->inverse[0]);
    *y = dot3(r, p->inverse[1]);
    if (!(*x >= 0 && *y >= 0 && (p->triangle ? *x + *y <= 1 : *x <= 1 && *y <= 1))) return 0;
    return distance * distance / fabs(along);
}

/* share / A of the group that a point of portal k is in; 0 where the element does not aim there. */
static double share_of_area(const portal_aim *aim, uint32_t k, double x, double y) {
    for (size_t g = 0; g < aim->n; g++) {
        const portal_group *one = &aim->group[g];
        if (k - one->first >= one->count) continue; /* unsigned: also below it */
        if (one->count == 1 &&
            !(x >= one->from[0] && y >= one->from[1] && x <= one->to[0] && y <= one->to[1]))
            continue;
        return one->share / one->area;
    }
    return 0;
}

/* True where a ray passes the box of a node. */
static bool passes(const portal_node *n, double margin, const double origin[3], const double direction[3]) {
    double enter = 0, leave = INFINITY;
    for (int d = 0; d < 3; d++) {
        const double low = n->low[d] - margin - origin[d], high = n->high[d] + margin - origin[d];
        if (direction[d] == 0) {
            if (low > 0 || high < 0) return false;
            continue;
        }
        const double a = low / direction[d], b = high / direction[d];
        enter = fmax(enter, fmin(a, b));
        leave = fmin(leave, fmax(a, b));
    }
    return enter <= leave;
}

/* A portal that a ray passes; r^2 / cos there, and the place along its edges. */
typedef void passed_visit(void *context, const portals *p, uint32_t k, double passed, double x, double y);

static void pass_all(const portals *p, const double origin[3], const double direction[3], passed_visit *visit,
                     void *context) {
    enum { DEEP = 64 };
    uint32_t stack[DEEP];
    size_t n = 0;
    if (p->n > 0) stack[n++] = 0;
    while (n > 0) {
        const uint32_t at = stack[--n];
        const portal_node *node = &p->node[at];
        if (node->count == 1) {
            double x, y;
            const double passed = passage(&p->portal[node->first], origin, direction, &x, &y);
            if (passed > 0) visit(context, p, node->first, passed, x, y);
        } else if (passes(node, p->margin, origin, direction)) {
            stack[n++] = node->second;
            stack[n++] = at + 1;
        }
    }
}

typedef struct density_sum {
    const portal_aim *aim;
    double sum;
} density_sum;

static void add_density(void *context, const portals *p, uint32_t k, double passed, double x, double y) {
    density_sum *d = context;
    (void)p;
    d->sum += passed * share_of_area(d->aim, k, x, y);
}

double portals_density(const portals *p, const portal_aim *aim, const double origin[3],
                       const double direction[3]) {
    density_sum d = {.aim = aim};
    if (aim->n > 0) pass_all(p, origin, direction, add_density, &d);
    return d.sum;
}

typedef struct opening_list {
    size_t n, most;
    uint32_t *openings;
} opening_list;

static void add_opening(void *context, const portals *p, uint32_t k, double passed, double x, double y) {
    opening_list *l = context;
    (void)passed;
    (void)x;
    (void)y;
    if (l->n < l->most) l->openings[l->n++] = p->portal[k].opening;
}

size_t portals_passed(const portals *p, const double origin[3], const double direction[3], size_t most,
                      uint32_t *openings) {
    opening_list l = {.most = most, .openings = openings};
    pass_all(p, origin, direction, add_opening, &l);
    return l.n;
}
