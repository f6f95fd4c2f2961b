/* Bytes of glTF, before it is made. */
#include "solver/codec/gltf/gltf.h"

static size_t sum_of_products(size_t n, const size_t (*terms)[2]) {
    size_t sum = 0, product;
    for (size_t k = 0; k < n; k++)
        if (!size_multiply(terms[k][0], terms[k][1], &product) || __builtin_add_overflow(sum, product, &sum))
            return SIZE_MAX;
    return sum;
}

/* Bytes of JSON: a name stands three times, six characters for one at most; the rest of a group has less than
 * this many characters, and that of the file. */
#define JSON_OF_NAME 18
#define JSON_OF_GROUP 2048
#define JSON_OF_FILE 4096
#define JSON_OF_NUMBER 9 /* of an element, with a comma */

size_t gltf_bytes_most(const gltf_sizes *sizes) {
    const size_t element = 4 * 8 * sizeof(float) + 6 * sizeof(uint32_t);
    /* A vertex has its number, and the first of its parts; one inside an edge is one more. */
    const size_t numbers = sizes->corners ? 4 * 2 * sizeof(float) : 0,
                 inside = 15 * sizeof(float) + 6 * sizeof(uint32_t);
    return sum_of_products(
        11,
        (const size_t[][2]){{sizes->n, element},
                            {sizes->n, numbers},
                            {sizes->n_inside, inside},
                            {sizes->n_weights, 2 * sizeof(float) + sizeof(uint32_t) / CORNER_WEIGHTS_OF_PART},
                            {sizes->n_buried, JSON_OF_NUMBER},
                            {sizes->n_textured, 4 * 5 * sizeof(float)},
                            {sizes->n_textures, JSON_OF_GROUP},
                            {sizes->image_bytes, 1},
                            {sizes->n_texts, JSON_OF_NAME},
                            {sizes->n_groups, JSON_OF_GROUP},
                            {JSON_OF_FILE, 1}});
}

size_t gltf_work_bytes(const gltf_sizes *sizes) {
    /* A vertex takes its position, three numbers, and up to four places of a hash table. */
    const size_t vertex = 3 * sizeof(float) + 7 * sizeof(uint32_t),
                 element = 4 * (3 * sizeof(float) + sizeof(uint32_t));
    return sum_of_products(7, (const size_t[][2]){{sizes->n, element},
                                                  {sizes->n_buried, JSON_OF_NUMBER},
                                                  {sizes->n_textures, JSON_OF_GROUP},
                                                  {sizes->n_vertices, vertex},
                                                  {sizes->n_texts, JSON_OF_NAME},
                                                  {sizes->n_groups, JSON_OF_GROUP + GLTF_PART_BYTES},
                                                  {JSON_OF_FILE, 1}});
}
