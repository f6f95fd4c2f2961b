/* Form factors as blocks on a tree of clusters (Hanrahan, Salzman and Aupperle 1991): light between two
 * clusters that see each other across some distance takes a few numbers, whatever the number of their
 * elements, A_i F_ij = A_i A_j  m_a(i)^T L m_b(j)    for all elements i of node a and j of node b, with
 * m_t(i) = (1, u, v) at the centroid of element i, in coordinates of the plane of t that run from -1 to 1
 * across t. Every pair of elements belongs to one block at most; pairs in none see nothing of each other. */
#ifndef LAMBERT_OPERATOR_BLOCKS_BLOCK_FACTORS_H
#define LAMBERT_OPERATOR_BLOCKS_BLOCK_FACTORS_H

#include "solver/linalg/factor_product.h"
#include "solver/operator/blocks/plane_tree.h"

/* 1, u, v */
enum { BLOCK_FUNCTIONS = 3 };

#define BLOCK_NO_NODE UINT32_MAX

/* Nodes are numbered: the clusters of the tree (postorder), then the elements by position. In the frame of
 * its plane, u = (x - centre[0]) * over[0], v = (y - centre[1]) * over[1]. A node with one function (a single
 * element, or a cluster of several planes) has over 0: m = (1, 0, 0). A node in one plane may have over 0 on
 * an axis along which all its centroids lie at its centre, and on no other. */
typedef struct block_node {
    uint32_t begin, end; /* its positions */
    uint32_t parent;     /* BLOCK_NO_NODE: it is the root. The parent of an element is its leaf */
    double centre[2], over[2];
} block_node;

/* Coordinates in the parent from those in a child: u' = shift + scale u. All elements of a child with over 0
 * lie at its centre; of a parent with over 0 the constant alone counts. */
typedef struct block_step {
    double shift[2], scale[2];
} block_step;

static inline block_step block_step_up(const block_node *child, const block_node *parent) {
    block_step s;
    for (int axis = 0; axis < 2; axis++) {
        s.shift[axis] = (child->centre[axis] - parent->centre[axis]) * parent->over[axis];
        s.scale[axis] = child->over[axis] != 0 ? parent->over[axis] / child->over[axis] : 0;
    }
    return s;
}

/* One direction of the light: S of the other one is the transpose. a and b have no element in common. */
typedef struct cluster_block {
    uint32_t a, b;
    float L[BLOCK_FUNCTIONS][BLOCK_FUNCTIONS]; /* 1/m^2 */
} cluster_block;

/* Blocks that grow in number (array_grow). */
typedef struct block_list {
    cluster_block *list;
    size_t count, capacity;
} block_list;

/* Clusters [first, last) of a subtree. */
typedef struct block_piece {
    size_t first, last;
} block_piece;

/* Blocks are cut by their a into this many parts, about equal in number, whatever the number of threads. */
enum { BLOCK_PARTS = 8 };

/* The blocks of nodes a in [first, last), and the least cluster and the least element, as nodes, among their
 * b, or where these end. */
typedef struct block_part {
    uint32_t first, last, least_cluster, least_element;
} block_part;

typedef struct block_factors {
    const plane_tree *tree; /* it outlives the blocks */
    size_t n, n_clusters;   /* of the tree */
    const uint32_t *order;  /* [n], position -> element, of the tree */
    block_node *nodes;      /* [n_clusters + n] */
    double (*place)[2];     /* [n] centroids by position, in the frame of the plane */
    double *area;           /* [n] by position, m^2 */
    double *balance; /* [n] by position: F_ij of the blocks is multiplied by balance_i balance_j, so that rows
                        have the sums that they must have; NULL: 1 */
    size_t n_blocks;
    cluster_block
        *blocks; /* [n_blocks], malloc; after block_factors_end a stands before b, by a, then by b */
    /* After block_factors_end the blocks of a node as a are from[t] ... from[t + 1] - 1, those as b are
     * into[into_from[t]] ... into[into_from[t + 1] - 1], by a. */
    size_t *from, *into_from; /* [n_clusters + n + 1] */
    uint32_t *into;           /* [n_blocks] */
    block_part parts[BLOCK_PARTS];
    block_piece *pieces; /* [n_pieces]: the largest subtrees of few elements, which threads share */
    uint32_t *above;     /* [n_above], the clusters above them, children first */
    size_t n_pieces, n_above;
} block_factors;

void block_factors_free(block_factors *f);

/* Nodes, places and areas of a tree, which must outlive them; no blocks. area and centre [n] by element. The
 * rectangles of nodes in a plane are those around the centroids; the caller may widen them until blocks refer
 * to them. Errors: LAM_ERR_MEMORY. */
lam_status block_factors_begin(const plane_tree *tree, const double *area, const double (*centre)[3],
                               block_factors *out, lam_error *error);

/* Call once after the blocks were set: turns those whose b stands before a, sorts them, unless they are so
 * already, and prepares products. Cost: O(n + n_blocks). Errors: LAM_ERR_MEMORY, also for 2^32 blocks and
 * more. */
lam_status block_factors_end(block_factors *f, lam_error *error);
/* The same with the blocks of several lists, which are freed and empty afterwards; after an error the lists
 * are the caller's, as they may be, with their blocks turned. */
lam_status block_factors_end_lists(block_factors *f, size_t n_lists, block_list *lists, lam_error *error);

/* y = F x for n_vectors vectors, [n][n_vectors] by position, y != x: moments of x go up the tree, through the
 * blocks, and down again, in O(n + n_blocks) steps for each vector. The bits do not depend on the number of
 * threads. Errors: LAM_ERR_MEMORY. */
lam_status block_factors_multiply(const block_factors *f, size_t n_vectors, const double *x, double *y,
                                  lam_error *error);

/* Vectors of a product: x[v] and y[v] are vector v, whose numbers stand `step` apart, by position or by
 * element. */
typedef struct block_vectors {
    size_t count, step;
    bool by_element;
    const double *const *x;
    double *const *y;
} block_vectors;

/* Vectors that share a pass; more of them take several. */
enum { BLOCK_VECTORS = 8 };

/* Bytes of work of a product with this many vectors. */
size_t block_factors_work(const block_factors *f, size_t n_vectors);

/* block_factors_multiply of at most BLOCK_VECTORS vectors in memory of the caller; it cannot fail. No y is an
 * x. */
void block_factors_apply(const block_factors *f, const block_vectors *vectors, void *work, size_t n_threads);

/* Products in mesh order, balance included. f must outlive it. */
factor_product block_factors_product(const block_factors *f);

#endif
